#include "core/integrate/adjoint_sweep.hpp"

#include "core/integrate/model_choice.hpp"

namespace mbsopt {

StoredStep::StoredStep(const Step& step, const Method& rk, std::span<const SampleEvent> events)
    : t(step.t),
      h(step.h),
      t1(step.t1),
      dense(step.dense),
      y0(step.y0),
      y_hat(step.y_hat),
      y1(step.y1),
      angles0(step.angles0),
      a(step.K.bottomRows(step.K.rows() / 2).leftCols(step.stages(rk))),
      lambda(step.lambda.leftCols(step.stages(rk))),
      projection(step.projection) {
  for (const SampleEvent& e : events) {
    if (e.cost) samples.push_back(e);
  }
}

std::size_t StoredStep::bytes() const {
  const Eigen::Index numbers = y0.size() + y_hat.size() + y1.size() + angles0.size() + a.size() + lambda.size() +
                               projection.nu.size() + projection.kappa.size() +
                               12 * static_cast<Eigen::Index>(projection.delta.size());
  return sizeof(*this) + sizeof(double) * static_cast<std::size_t>(numbers) + sizeof(SampleEvent) * samples.size();
}

AdjointSweep::AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           std::span<const Cost> costs)
    : mechanism_(mechanism),
      rk_(method),
      costs_(costs),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(mechanism, settings.formulation.projection, model_of(mechanism, settings, method)) {
  const MechanismData& d = mechanism.data();
  if (d.needs_motion) motion_.emplace(mechanism, settings.formulation);
  const Eigen::Index states = mechanism.states(), objectives = static_cast<Eigen::Index>(costs.size());
  lambda_.setZero(states, objectives);
  lambda_hat_.setZero(states, objectives);
  sample_bar_.setZero(states, objectives);
  theta_bar_.setZero(d.slots(), objectives);
  rho_bar_.setZero(d.rho.size(), objectives);
  Y_.setZero(states, rk_.dense_stages);
  K_.setZero(states, rk_.dense_stages);
  K_bar_.assign(costs.size(), Eigen::MatrixXd::Zero(states, rk_.dense_stages));
  if (const int coupled = largest_implicit_group(rk_); coupled > 0) {
    implicit_.emplace(d, rk_);
    Y_bar_.assign(costs.size(), Eigen::MatrixXd::Zero(states, coupled));
    x_bar_.setZero(coupled * dynamics_.equations(), objectives);
  }
  for (Eigen::VectorXd* x : {&y_, &w_, &y_bar_}) x->setZero(states);
  theta_.setZero(d.slots());
  rho_.setZero(d.rho.size());
  r_bar_.setZero(dynamics_.equations());
}

void AdjointSweep::begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  lambda_.setZero(), theta_bar_.setZero(), rho_bar_.setZero();
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    const Eigen::Index column = static_cast<Eigen::Index>(o);
    if (costs_[o].terminal) {
      costs_[o].terminal->add_gradient({t, y, angles, motion()}, 1, lambda_.col(column), rho_bar_.col(column));
    }
  }
}

void AdjointSweep::rebuild(const StoredStep& step) {
  const int stages = static_cast<int>(step.a.cols());
  K_.bottomRows(mechanism_.states() / 2).leftCols(stages) = step.a;
  for (const StageGroup& g : rk_.stage_groups()) {
    if (g.first < stages) set_group_stages(rk_, g, step.h, step.y0, Y_, K_);
  }
}

bool AdjointSweep::step_back(const StoredStep& step) {
  const int stages = static_cast<int>(step.a.cols());
  const Eigen::Index objectives = lambda_.cols();
  rebuild(step);
  for (Eigen::MatrixXd& K_bar : K_bar_) K_bar.setZero();
  lambda_hat_.setZero();

  // Samples: shares of y0, k_i, and of (y1 - y^) by the blend.
  sample_bar_.setZero();
  for (const SampleEvent& e : step.samples) {
    const double theta = (e.time - step.t) / step.h, blend = projection_blend(theta);
    y_ = step.y0 + blend * (step.y1 - step.y_hat);
    for (int i = 0; i < stages; ++i) y_ += (step.h * rk_.dense_weight(i, theta)) * K_.col(i);
    y_bar_.setZero();
    e.cost->add_gradient({e.time, y_, step.angles0, motion()}, 1, y_bar_, rho_bar_.col(e.objective));
    sample_bar_.col(e.objective) += y_bar_;
    lambda_.col(e.objective) += blend * y_bar_;
    lambda_hat_.col(e.objective) -= blend * y_bar_;
    Eigen::MatrixXd& K_bar = K_bar_[static_cast<std::size_t>(e.objective)];
    for (int i = 0; i < stages; ++i) K_bar.col(i) += (step.h * rk_.dense_weight(i, theta)) * y_bar_;
  }

  if (projector_.active()) {
    if (!projector_.linearise(step.t1, step.angles0, step.y_hat, step.y1, step.projection)) return false;
    for (Eigen::Index o = 0; o < objectives; ++o) {
      w_ = lambda_.col(o);
      y_bar_ = lambda_hat_.col(o);
      theta_ = theta_bar_.col(o);
      rho_ = rho_bar_.col(o);
      projector_.add_adjoint(w_, y_bar_, theta_, rho_);
      lambda_hat_.col(o) = y_bar_;
      theta_bar_.col(o) = theta_;
      rho_bar_.col(o) = rho_;
    }
  } else {
    lambda_hat_ += lambda_;
  }

  for (Eigen::Index o = 0; o < objectives; ++o) {
    Eigen::MatrixXd& K_bar = K_bar_[static_cast<std::size_t>(o)];
    for (int i = 0; i < rk_.stages; ++i) {
      if (rk_.b[i] != 0) K_bar.col(i) += (step.h * rk_.b[i]) * lambda_hat_.col(o);
    }
  }
  lambda_ = lambda_hat_ + sample_bar_;  // from here on of y0

  const std::span<const StageGroup> groups = rk_.stage_groups();
  for (auto g = groups.rbegin(); g != groups.rend(); ++g) {
    if (g->first >= stages || !is_used(rk_, *g, step.dense)) continue;
    if (!(is_implicit(rk_, *g) ? implicit_back(step, *g) : explicit_back(step, g->first))) return false;
  }
  return true;
}

bool AdjointSweep::explicit_back(const StoredStep& step, int i) {
  const double t = step.t + rk_.c[i] * step.h;
  const bool in_step = i < rk_.stages && rk_.b[i] != 0;
  y_ = Y_.col(i);
  if (!dynamics_.linearise(t, y_, step.angles0, step.a.col(i), step.lambda.col(i))) return false;
  for (Eigen::Index o = 0; o < lambda_.cols(); ++o) {
    Eigen::MatrixXd& K_bar = K_bar_[static_cast<std::size_t>(o)];
    w_ = K_bar.col(i);
    y_bar_.setZero();
    theta_ = theta_bar_.col(o);
    rho_ = rho_bar_.col(o);
    dynamics_.add_adjoint(w_, y_bar_, theta_, rho_);
    const PointCost* running = costs_[static_cast<std::size_t>(o)].running.get();
    if (running && in_step) running->add_gradient({t, y_, step.angles0, motion()}, step.h * rk_.b[i], y_bar_, rho_);
    theta_bar_.col(o) = theta_;
    rho_bar_.col(o) = rho_;
    lambda_.col(o) += y_bar_;
    for (int j = 0; j < i; ++j) {
      const double a = rk_.a(i, j);
      if (a != 0) K_bar.col(j) += (step.h * a) * y_bar_;
    }
  }
  return true;
}

// The transpose of TangentSweep::follow_implicit. With bars for cotangents, sums over the group's own stages:
//   Vbar_i = kbar_q,i + Ybar_v,i + h sum_j A_ji Qbar_j,   abar_i = kbar_v,i + h sum_j A_ji Vbar_j,   N'rbar = (abar, 0)
//   Q*bar_i = Qbar_i + r_q'rbar_i,   V*bar_i = Vbar_i + r_v'rbar_i + h sum_j A_ji (r_q'rbar_j)
// Qbar, Ybar: of running costs, whose value is taken at the stage itself.
bool AdjointSweep::implicit_back(const StoredStep& step, const StageGroup& g) {
  const Eigen::Index n = mechanism_.states() / 2, rows = dynamics_.equations(), objectives = lambda_.cols();
  auto time_of = [&](int i) { return step.t + rk_.c[i] * step.h; };
  auto place = [&](int i) {
    y_ = Y_.col(i);
    dynamics_.place_at(time_of(i), y_, step.angles0, step.a.col(i), step.lambda.col(i));
  };
  for (int i = g.first; i <= g.last; ++i) {
    place(i);
    implicit_->linearise(dynamics_, i - g.first);
  }
  if (!implicit_->factor(step.h, g)) return false;

  for (Eigen::Index o = 0; o < objectives; ++o) {
    const Eigen::MatrixXd& K_bar = K_bar_[static_cast<std::size_t>(o)];
    Eigen::MatrixXd& Y_bar = Y_bar_[static_cast<std::size_t>(o)];
    const PointCost* running = costs_[static_cast<std::size_t>(o)].running.get();
    x_bar_.col(o).setZero();
    for (int i = g.first; i <= g.last; ++i) {
      y_bar_.setZero();
      if (running && i < rk_.stages && rk_.b[i] != 0) {
        y_ = Y_.col(i);
        rho_ = rho_bar_.col(o);
        running->add_gradient({time_of(i), y_, step.angles0, motion()}, step.h * rk_.b[i], y_bar_, rho_);
        rho_bar_.col(o) = rho_;
      }
      Y_bar.col(i - g.first) = y_bar_;
    }
    for (int i = g.first; i <= g.last; ++i) {
      auto V_bar = Y_bar.col(i - g.first).tail(n);
      V_bar += K_bar.col(i).head(n);
      for (int j = g.first; j <= g.last; ++j) V_bar += (step.h * rk_.a(j, i)) * Y_bar.col(j - g.first).head(n);
    }
    for (int i = g.first; i <= g.last; ++i) {
      auto a_bar = x_bar_.col(o).segment((i - g.first) * rows, n);
      a_bar = K_bar.col(i).tail(n);
      for (int j = g.first; j <= g.last; ++j) a_bar += (step.h * rk_.a(j, i)) * Y_bar.col(j - g.first).tail(n);
    }
  }
  implicit_->solve_transposed(g, x_bar_);

  for (int i = g.last; i >= g.first; --i) {
    if (i != g.last) place(i);  // where the last still is
    for (Eigen::Index o = 0; o < objectives; ++o) {
      Eigen::MatrixXd& Y_bar = Y_bar_[static_cast<std::size_t>(o)];
      r_bar_ = x_bar_.col(o).segment((i - g.first) * rows, rows);
      y_bar_.setZero();
      theta_ = theta_bar_.col(o);
      rho_ = rho_bar_.col(o);
      dynamics_.add_residual_adjoint(r_bar_, y_bar_, theta_, rho_);
      theta_bar_.col(o) = theta_;
      rho_bar_.col(o) = rho_;
      Y_bar.col(i - g.first) += y_bar_;
      for (int j = g.first; j <= g.last; ++j) {
        Y_bar.col(j - g.first).tail(n) += (step.h * rk_.a(i, j)) * y_bar_.head(n);
      }
    }
  }
  for (Eigen::Index o = 0; o < objectives; ++o) {
    const Eigen::MatrixXd& Y_bar = Y_bar_[static_cast<std::size_t>(o)];
    for (int i = g.first; i <= g.last; ++i) {
      lambda_.col(o) += Y_bar.col(i - g.first);
      for (int j = 0; j < g.first; ++j) {
        const double a = rk_.a(i, j);
        if (a != 0) K_bar_[static_cast<std::size_t>(o)].col(j) += (step.h * a) * Y_bar.col(i - g.first);
      }
    }
  }
  return true;
}

Eigen::MatrixXd AdjointSweep::mu() const {
  Eigen::MatrixXd mu = rho_bar_;
  for (Eigen::Index o = 0; o < mu.cols(); ++o) mechanism_.data().add_to_rho(theta_bar_.col(o), mu.col(o));
  return mu;
}

}  // namespace mbsopt
