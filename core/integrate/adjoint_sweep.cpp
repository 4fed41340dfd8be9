#include "core/integrate/adjoint_sweep.hpp"

#include <algorithm>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

AdjointSweep::AdjointSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           std::span<const Cost> costs, bool watched, const StatePoint& end)
    : Sweep(mechanism, settings, method, costs, watched), step_(make_step(mechanism, method, projector_->solution())) {
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states(), objectives = static_cast<Eigen::Index>(costs.size());
  for (Eigen::Index o = 0; o < objectives; ++o) {
    Bars& b = bars_.emplace_back();
    b.objective = o;
    for (Eigen::VectorXd* x : {&b.lambda, &b.lambda_hat, &b.samples}) x->setZero(states);
    b.theta.setZero(d.slots());
    b.rho.setZero(d.rho.size());
    for (Eigen::MatrixXd* x : {&b.K, &b.Y}) x->setZero(states, rk_.dense_stages);
    if (rk_.gamma) {
      b.start.setZero(states);
      b.common.setZero(states);
    }
    const PointCost* const terminal = costs[static_cast<std::size_t>(o)].terminal.get();
    if (terminal) terminal->add_gradient(end, 1, b.lambda, b.rho);
  }
  if (const int coupled = largest_implicit_group(rk_); coupled > 0)
    x_bar_.setZero(coupled * StageEquations::count(d), objectives);
  if (rk_.gamma) x_bar_.setZero(states, objectives);
  for (Eigen::VectorXd* x : {&w_, &y_bar_}) x->setZero(states);
  r_bar_.setZero(StageEquations::count(d));
  explicit_swept_.reserve(static_cast<std::size_t>(rk_.dense_stages));
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
  for (const Bars& b : bars_)
    if (const double size = std::abs(psi(b.objective)); size != 0) most = std::max(most, b.largest / size);
  return most;
}

bool AdjointSweep::step_back(const StoredStep& step) {
  rebuild(step);
  for (Bars& b : bars_) {
    b.largest = std::max(b.largest, b.lambda.cwiseAbs().dot(step_.y1.cwiseAbs()));
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
    for (Bars& b : bars_) {
      y_bar_.setZero();
      add_running_cost(b, m);
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
    for (const Bars& b : bars_) x_bar_.col(b.objective) = b.K.col(i);
    rosenbrock.solve_transposed(x_bar_);
    if (i > 0 && !rosenbrock.linearise_stage(step_, i)) return false;
    for (Bars& b : bars_) {
      const auto r_bar = x_bar_.col(b.objective);
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
      for (Bars& b : bars_) {
        w_.setZero();
        w_.tail(n) = rosenbrock.own_weight(sign) * x_bar_.col(b.objective).tail(n);
        dynamics_.add_adjoint(w_, b.lambda, b.theta, b.rho);
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

void AdjointSweep::add_running_cost(Bars& b, int node) {
  if (!set_running_gradient(step_, static_cast<std::size_t>(b.objective), node)) return;
  y_bar_ += g_.y;
  b.rho += g_.rho;
}

bool AdjointSweep::explicit_back(int i) {
  if (!linearise_stage(step_, i)) return false;
  for (Bars& b : bars_) {
    StageSum w;  // kbar_i
    for (const int j : explicit_swept_) w.add(step_.h * rk_.a(j, i), b.Y.col(j).data());
    w.to(b.K.col(i).data(), w_.data(), w_.size());
    y_bar_.setZero();
    dynamics_.add_adjoint(w_, y_bar_, b.theta, b.rho);
    add_running_cost(b, i);
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

  for (Bars& b : bars_) {
    auto x_bar = x_bar_.col(b.objective);
    x_bar.setZero();
    for (int i = g.first; i <= g.last; ++i) {
      y_bar_.setZero();
      y_ = step_.Y.col(i);
      add_running_cost(b, i);
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
    for (Bars& b : bars_) {
      r_bar_ = x_bar_.col(b.objective).segment((i - g.first) * rows, rows);
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

// The transpose of TangentSweep::cross_limit.
void AdjointSweep::cross_limit_back(Switches& switches, const SwitchEvent& event, const StatePoint& at) {
  if (!set_strike(switches, event, at)) return;
  const auto& [impact, f_before, f_after, r_y, r_rho, c_y, c_rho, e, slot_e] = strike_;
  const Eigen::Index n = impact.w.size();
  std::vector<double> kappa;
  Eigen::MatrixXd w_bar(n, static_cast<Eigen::Index>(bars_.size()));
  for (Bars& b : bars_) {
    kappa.push_back(event_.jump_of_costs(b.objective) - f_after.dot(b.lambda));
    const double L_bar = impact.w.dot(b.lambda.tail(n)) / impact.c;
    w_bar.col(b.objective) = impact.Ln * (b.lambda.tail(n) - L_bar * c_y.tail(n));
    b.lambda.head(n) -= impact.Ln * L_bar * c_y.head(n);
    b.lambda -= (1 + e) * L_bar * r_y;
    b.rho -= impact.Ln * L_bar * c_rho + (1 + e) * L_bar * r_rho;
    if (slot_e >= 0) b.theta(slot_e) -= impact.r * L_bar;
  }
  for (const double sign : {1.0, -1.0}) {
    const bool linearised = linearise_pushed(switches, event, at, sign * impact.mu);
    for (Bars& b : bars_) {
      if (!linearised) break;
      w_.setZero();
      w_.tail(n) = sign / (2 * impact.mu) * w_bar.col(b.objective);
      dynamics_.add_adjoint(w_, b.lambda, b.theta, b.rho);
    }
    switches.push(event.of, 0);
  }
  for (Bars& b : bars_) {
    const double k = (kappa[static_cast<std::size_t>(b.objective)] + f_before.dot(b.lambda)) / event_.rate;
    b.lambda -= k * event_.g_y;
    b.rho -= k * event_.g_rho;
  }
}

void AdjointSweep::cross_back(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at) {
  if (switches.is_limit(event.of)) return cross_limit_back(switches, event, at);
  if (!set_event(switches, event, first, at, true)) return;
  for (Bars& b : bars_) {
    const double kappa = (event_.jump.dot(b.lambda) + event_.jump_of_costs(b.objective)) / event_.rate;
    b.lambda -= kappa * event_.g_y;
    b.rho -= kappa * event_.g_rho;
  }
}

Eigen::MatrixXd AdjointSweep::lambda() const {
  Eigen::MatrixXd lambda(mechanism_.states(), static_cast<Eigen::Index>(bars_.size()));
  for (const Bars& b : bars_) lambda.col(b.objective) = b.lambda;
  return lambda;
}

Eigen::MatrixXd AdjointSweep::mu() const {
  const MechanismData& d = mechanism_.data();
  Eigen::MatrixXd mu(d.rho.size(), static_cast<Eigen::Index>(bars_.size()));
  for (const Bars& b : bars_) {
    mu.col(b.objective) = b.rho;
    d.add_to_rho(b.theta, mu.col(b.objective));
  }
  return mu;
}

}  // namespace mbsopt
