#include "core/integrate/adjoint_sweep.hpp"

#include <algorithm>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

AdjointSweep::AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           std::span<const Cost> costs, bool watched, const StatePoint& end)
    : Sweep(mechanism, settings, method, costs, watched),
      step_(make_step(mechanism, method, projector_->solution())),
      bars_(costs.size()) {
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states(), objectives = static_cast<Eigen::Index>(costs.size());
  for (Bars& b : bars_) {
    for (Eigen::VectorXd* x : {&b.lambda, &b.lambda_hat, &b.samples}) x->setZero(states);
    b.theta.setZero(d.slots());
    b.rho.setZero(d.rho.size());
    for (Eigen::MatrixXd* x : {&b.K, &b.Y}) x->setZero(states, rk_.dense_stages);
    if (rk_.gamma) {
      b.start.setZero(states);
      b.common.setZero(states);
    }
  }
  if (const int coupled = largest_implicit_group(rk_); coupled > 0)
    x_bar_.setZero(coupled * StageEquations::count(d), objectives);
  if (rk_.gamma) x_bar_.setZero(states, objectives);
  for (Eigen::VectorXd* x : {&w_, &y_bar_}) x->setZero(states);
  r_bar_.setZero(StageEquations::count(d));
  explicit_swept_.reserve(static_cast<std::size_t>(rk_.dense_stages));
  for (std::size_t o = 0; o < costs_.size(); ++o)
    if (costs_[o].terminal) costs_[o].terminal->add_gradient(end, 1, bars_[o].lambda, bars_[o].rho);
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
  for (Bars& b : bars_) {
    b.lambda_hat.setZero();
    b.samples.setZero();
    b.K.setZero();
  }
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
  if (!(rosenbrock_ ? rosenbrock_back() : stages_back())) return false;
  end_step(step_);
  return true;
}

bool AdjointSweep::stages_back() {
  explicit_swept_.clear();
  const std::span<const StageGroup> groups = rk_.stage_groups();
  for (auto g = groups.rbegin(); g != groups.rend(); ++g) {
    if (g->first >= step_.stages(rk_) || !is_used(rk_, *g, step_.dense)) continue;
    if (!(is_implicit(rk_, *g) ? implicit_back(*g) : explicit_back(g->first))) return false;
  }
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

// The gradient of the running cost at a node, whose state is y_, into y_bar_ and the objective's rho.
void AdjointSweep::add_running_cost(std::size_t objective, int node) {
  if (!set_running_gradient(step_, objective, node)) return;
  y_bar_ += g_y_;
  bars_[objective].rho += g_rho_;
}

bool AdjointSweep::explicit_back(int i) {
  if (!linearise_stage(step_, i)) return false;
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
  StageEquations* equations = nullptr;
  for (int i = g.first; i <= g.last; ++i) equations = &implicit_->linearise(step_, i, i - g.first);
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
    if (i != g.last) implicit_->place_at(step_, i);  // where the last still is
    for (std::size_t o = 0; o < bars_.size(); ++o) {
      Bars& b = bars_[o];
      r_bar_ = x_bar_.col(static_cast<Eigen::Index>(o)).segment((i - g.first) * rows, rows);
      y_bar_.setZero();
      equations->add_adjoint(r_bar_, y_bar_, b.theta, b.rho);
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
