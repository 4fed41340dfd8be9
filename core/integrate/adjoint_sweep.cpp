#include "core/integrate/adjoint_sweep.hpp"

#include <algorithm>

#include "core/integrate/model_choice.hpp"

namespace mbsopt {

AdjointSweep::AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           std::span<const Cost> costs, GradientQuadrature* watch)
    : mechanism_(mechanism),
      rk_(method),
      costs_(costs),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(make_projector(mechanism, settings.formulation.projection, model_of(mechanism, settings, method))),
      step_(make_step(mechanism, method, projector_->solution())),
      bars_(costs.size()),
      watch_(watch) {
  const MechanismData& d = mechanism.data();
  if (d.needs_motion) motion_.emplace(mechanism, settings.formulation);
  const Eigen::Index states = mechanism.states();
  for (Bars& b : bars_) {
    for (Eigen::VectorXd* x : {&b.lambda, &b.lambda_hat, &b.samples}) x->setZero(states);
    b.theta.setZero(d.slots());
    b.rho.setZero(d.rho.size());
    for (Eigen::MatrixXd* x : {&b.K, &b.Y}) x->setZero(states, rk_.dense_stages);
  }
  if (const int coupled = largest_implicit_group(rk_); coupled > 0) {
    equations_.emplace(dynamics_.in_space());
    implicit_.emplace(d, rk_);
    x_bar_.setZero(coupled * StageEquations::count(d), static_cast<Eigen::Index>(costs.size()));
  }
  if (rk_.gamma) {
    rosenbrock_.emplace(mechanism, rk_, dynamics_);
    for (Bars& b : bars_) b.start.setZero(states), b.common.setZero(states);
    x_bar_.setZero(states, static_cast<Eigen::Index>(costs.size()));
  }
  for (Eigen::VectorXd* x : {&y_, &ydot_, &w_, &y_bar_, &g_y_}) x->setZero(states);
  g_rho_.setZero(d.rho.size());
  r_bar_.setZero(StageEquations::count(d));
  explicit_swept_.reserve(static_cast<std::size_t>(rk_.dense_stages));
}

void AdjointSweep::begin(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    Bars& b = bars_[o];
    b.lambda.setZero(), b.theta.setZero(), b.rho.setZero();
    if (costs_[o].terminal) costs_[o].terminal->add_gradient({t, y, angles, motion()}, 1, b.lambda, b.rho);
  }
}

void AdjointSweep::rebuild(const StoredStep& step) {
  step.restore(rk_, step_);
  for (const StageGroup& g : rk_.stage_groups()) {
    if (g.first < step_.stages(rk_)) set_group_stages(rk_, g, step_.h, step_.y0, step_.Y, step_.K);
  }
}

// Shares of y0, k_i, and of (y1 - y^) by the blend.
void AdjointSweep::sample_back(const StoredStep& step) {
  const int stages = step_.stages(rk_);
  for (const SampleEvent& e : step.samples) {
    const double theta = (e.time - step.t) / step.h, blend = projection_blend(theta);
    Bars& b = bars_[static_cast<std::size_t>(e.objective)];
    dense_output(rk_, step_, theta, y_);
    y_bar_.setZero();
    e.cost->add_gradient({e.time, y_, step_.angles0, motion()}, 1, y_bar_, b.rho);
    b.samples += y_bar_;
    b.lambda += blend * y_bar_;
    b.lambda_hat -= blend * y_bar_;
    for (int i = 0; i < stages; ++i) b.K.col(i) += (step.h * rk_.dense_weight(i, theta)) * y_bar_;
  }
}

double AdjointSweep::magnification(const Eigen::VectorXd& psi) const {
  double most = 0;
  for (Eigen::Index o = 0; o < psi.size(); ++o)
    if (psi(o) != 0) most = std::max(most, bars_[static_cast<std::size_t>(o)].largest / std::abs(psi(o)));
  return most;
}

bool AdjointSweep::step_back(const StoredStep& step) {
  rebuild(step);
  for (Bars& b : bars_) b.largest = std::max(b.largest, b.lambda.cwiseAbs().dot(step_.y1.cwiseAbs()));
  for (Bars& b : bars_) b.lambda_hat.setZero(), b.samples.setZero(), b.K.setZero();
  sample_back(step);
  if (rosenbrock_) nodes_back();

  if (projector_->active()) {
    if (!projector_->linearise(step_.t1, step_.angles0, step_.y_hat, step_.y1, step_.projection)) return false;
    for (Bars& b : bars_) projector_->add_adjoint(b.lambda, b.lambda_hat, b.theta, b.rho);
  } else {
    for (Bars& b : bars_) b.lambda_hat += b.lambda;
  }

  for (Bars& b : bars_) {
    for (int i = 0; i < rk_.stages; ++i) {
      if (rk_.b[i] != 0) b.K.col(i) += (step_.h * rk_.b[i]) * b.lambda_hat;
    }
    b.lambda = b.lambda_hat + b.samples;
  }

  if (rosenbrock_) {
    if (watch_) watch_->end_step(step_);
    return rosenbrock_back();
  }
  explicit_swept_.clear();
  const std::span<const StageGroup> groups = rk_.stage_groups();
  for (auto g = groups.rbegin(); g != groups.rend(); ++g) {
    if (g->first >= step_.stages(rk_) || !is_used(rk_, *g, step_.dense)) continue;
    if (!(is_implicit(rk_, *g) ? implicit_back(*g) : explicit_back(g->first))) return false;
  }
  if (watch_) watch_->end_step(step_);
  for (Bars& b : bars_) {
    StageSum sum;
    for (const int i : explicit_swept_) sum.add(1, b.Y.col(i).data());
    sum.to(b.lambda.data(), b.lambda.data(), b.lambda.size());
  }
  return true;
}

// Shares of y0 and k_i of the running costs at nodes of the dense output.
void AdjointSweep::nodes_back() {
  for (int m = 0; m < rk_.nodes; ++m) {
    node_state(rk_, step_, m, y_);
    for (std::size_t o = 0; o < bars_.size(); ++o) {
      Bars& b = bars_[o];
      y_bar_.setZero();
      add_running_cost(o, m);
      b.samples += y_bar_;
      for (int i = 0; i < rk_.stages; ++i) b.K.col(i) += (step_.h * rk_.dense_weight(i, rk_.node_c[m])) * y_bar_;
    }
  }
}

// The transpose of TangentSweep::follow_rosenbrock, where kbar_i is known:
//   rbar_i = inverse of (I - h g f_y)' times kbar_i,   sbar = rbar_i - kbar_i,   kbar_j += gamma_ij/g sbar, j < i
//   Ybar_i = f_y(Y_i)'rbar_i,   kbar_j += h A_ij Ybar_i,   y0bar += Ybar_i + D(0, w_i)'rbar_i
// and y0bar += D(h, h k_0)' sum_i gamma_i rbar_i
bool AdjointSweep::rosenbrock_back() {
  RosenbrockStages& rosenbrock = *rosenbrock_;
  const Eigen::Index n = mechanism_.states() / 2;
  const double g = rk_.gamma_of(0, 0);
  if (!rosenbrock.factor(step_)) return false;
  for (Bars& b : bars_) b.common.setZero();
  for (int i = rk_.stages - 1; i >= 0; --i) {
    for (std::size_t o = 0; o < bars_.size(); ++o) x_bar_.col(static_cast<Eigen::Index>(o)) = bars_[o].K.col(i);
    for (Eigen::Index first = 0; first < x_bar_.cols(); first += kLanes) {
      rosenbrock.solve_transposed(x_bar_.middleCols(first, std::min<Eigen::Index>(kLanes, x_bar_.cols() - first)));
    }
    if (i > 0 && !rosenbrock.linearise_stage(step_, i)) return false;
    for (std::size_t o = 0; o < bars_.size(); ++o) {
      Bars& b = bars_[o];
      const auto r_bar = x_bar_.col(static_cast<Eigen::Index>(o));
      for (int j = 0; j < i; ++j) b.K.col(j) += (rk_.gamma_of(i, j) / g) * (r_bar - b.K.col(i));
      b.common.tail(n) += rk_.gamma_sum[i] * r_bar.tail(n);
      if (i == 0) {
        b.start = r_bar;
        continue;
      }
      w_ = r_bar;
      y_bar_.setZero();
      dynamics_.add_adjoint(w_, y_bar_, b.theta, b.rho);
      b.lambda += y_bar_;
      for (int j = 0; j < i; ++j) {
        if (rk_.a(i, j) != 0) b.K.col(j) += (step_.h * rk_.a(i, j)) * y_bar_;
      }
    }
    for (const int sign : {-1, 1}) {
      if (i == 0) break;  // w_0 = 0
      if (!rosenbrock.linearise_own(step_, i, sign)) return false;
      for (std::size_t o = 0; o < bars_.size(); ++o) {
        w_.setZero();
        w_.tail(n) = rosenbrock.own_weight(sign) * x_bar_.col(static_cast<Eigen::Index>(o)).tail(n);
        dynamics_.add_adjoint(w_, bars_[o].lambda, bars_[o].theta, bars_[o].rho);
      }
    }
  }
  for (int k = 0; k < RosenbrockStages::kPoints; ++k) {
    if (!rosenbrock.linearise_common(step_, k)) return false;
    for (Bars& b : bars_) {
      w_ = rosenbrock.common_weight(k) * b.common;
      if (k == 0) w_ += b.start;
      dynamics_.add_adjoint(w_, b.lambda, b.theta, b.rho);
    }
  }
  return true;
}

void AdjointSweep::add_running_cost(std::size_t objective, int node) {
  const PointCost* const running = costs_[objective].running.get();
  if (!running || node >= rk_.nodes || rk_.node_b[node] == 0) return;
  const double weight = step_.h * rk_.node_b[node];
  g_y_.setZero(), g_rho_.setZero();
  running->add_gradient({step_.t + rk_.node_c[node] * step_.h, y_, step_.angles0, motion()}, weight, g_y_, g_rho_);
  if (watch_) {
    node_rate(rk_, step_, node, ydot_);
    watch_->take(objective, node, weight, g_y_, ydot_, g_rho_);
  }
  y_bar_ += g_y_, bars_[objective].rho += g_rho_;
}

bool AdjointSweep::explicit_back(int i) {
  const double t = step_.t + rk_.c[i] * step_.h;
  y_ = step_.Y.col(i);
  const Eigen::Index half = mechanism_.states() / 2;
  if (!dynamics_.linearise(t, y_, step_.angles0, step_.K.col(i).tail(half), step_.lambda.col(i))) return false;
  for (std::size_t o = 0; o < bars_.size(); ++o) {
    Bars& b = bars_[o];
    StageSum w;  // kbar_i
    for (const int j : explicit_swept_) w.add(step_.h * rk_.a(j, i), b.Y.col(j).data());
    w.to(b.K.col(i).data(), w_.data(), w_.size());
    y_bar_.setZero();
    dynamics_.add_adjoint(w_, y_bar_, b.theta, b.rho);
    add_running_cost(o, i);
    b.Y.col(i) = y_bar_;
  }
  explicit_swept_.push_back(i);
  return true;
}

// The transpose of TangentSweep::follow_implicit. With bars for cotangents, sums over the group's own stages:
//   Vbar_i = kbar_q,i + Ybar_v,i + h sum_j A_ji Qbar_j,   abar_i = kbar_v,i + h sum_j A_ji Vbar_j,   N'rbar = (abar, 0)
//   Q*bar_i = Qbar_i + r_q'rbar_i,   V*bar_i = Vbar_i + r_v'rbar_i + h sum_j A_ji (r_q'rbar_j)
// Qbar, Ybar: of running costs, whose value is taken at the stage itself.
bool AdjointSweep::implicit_back(const StageGroup& g) {
  const Eigen::Index n = mechanism_.states() / 2, rows = StageEquations::count(mechanism_.data());
  auto time_of = [&](int i) { return step_.t + rk_.c[i] * step_.h; };
  auto place = [&](int i) {
    y_ = step_.Y.col(i);
    equations_->place_at(time_of(i), y_, step_.angles0, step_.K.col(i).tail(n), step_.lambda.col(i));
  };
  for (int i = g.first; i <= g.last; ++i) {
    place(i);
    implicit_->linearise(*equations_, i - g.first);
  }
  if (!implicit_->factor(step_.h, g)) return false;

  for (std::size_t o = 0; o < bars_.size(); ++o) {
    Bars& b = bars_[o];
    auto x_bar = x_bar_.col(static_cast<Eigen::Index>(o));
    x_bar.setZero();
    for (int i = g.first; i <= g.last; ++i) {
      y_bar_.setZero();
      y_ = step_.Y.col(i);
      add_running_cost(o, i);
      b.Y.col(i) = y_bar_;
    }
    for (int i = g.first; i <= g.last; ++i) {
      for (const int j : explicit_swept_) b.K.col(i) += (step_.h * rk_.a(j, i)) * b.Y.col(j);
      auto V_bar = b.Y.col(i).tail(n);
      V_bar += b.K.col(i).head(n);
      for (int j = g.first; j <= g.last; ++j) V_bar += (step_.h * rk_.a(j, i)) * b.Y.col(j).head(n);
    }
    for (int i = g.first; i <= g.last; ++i) {
      auto a_bar = x_bar.segment((i - g.first) * rows, n);
      a_bar = b.K.col(i).tail(n);
      for (int j = g.first; j <= g.last; ++j) a_bar += (step_.h * rk_.a(j, i)) * b.Y.col(j).tail(n);
    }
  }
  implicit_->solve_transposed(g, x_bar_);

  for (int i = g.last; i >= g.first; --i) {
    if (i != g.last) place(i);  // where the last still is
    for (std::size_t o = 0; o < bars_.size(); ++o) {
      Bars& b = bars_[o];
      r_bar_ = x_bar_.col(static_cast<Eigen::Index>(o)).segment((i - g.first) * rows, rows);
      y_bar_.setZero();
      equations_->add_adjoint(r_bar_, y_bar_, b.theta, b.rho);
      b.Y.col(i) += y_bar_;
      for (int j = g.first; j <= g.last; ++j) b.Y.col(j).tail(n) += (step_.h * rk_.a(i, j)) * y_bar_.head(n);
    }
  }
  for (Bars& b : bars_) {
    for (int i = g.first; i <= g.last; ++i) {
      b.lambda += b.Y.col(i);
      for (int j = 0; j < g.first; ++j) {
        const double a = rk_.a(i, j);
        if (a != 0) b.K.col(j) += (step_.h * a) * b.Y.col(i);
      }
    }
  }
  return true;
}

Eigen::MatrixXd AdjointSweep::lambda() const {
  Eigen::MatrixXd lambda(mechanism_.states(), static_cast<Eigen::Index>(bars_.size()));
  for (std::size_t o = 0; o < bars_.size(); ++o) lambda.col(static_cast<Eigen::Index>(o)) = bars_[o].lambda;
  return lambda;
}

Eigen::MatrixXd AdjointSweep::mu() const {
  const MechanismData& d = mechanism_.data();
  Eigen::MatrixXd mu(d.rho.size(), static_cast<Eigen::Index>(bars_.size()));
  for (std::size_t o = 0; o < bars_.size(); ++o) {
    auto of_objective = mu.col(static_cast<Eigen::Index>(o));
    of_objective = bars_[o].rho;
    d.add_to_rho(bars_[o].theta, of_objective);
  }
  return mu;
}

}  // namespace mbsopt
