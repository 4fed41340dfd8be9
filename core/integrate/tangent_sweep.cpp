#include "core/integrate/tangent_sweep.hpp"

#include <algorithm>
#include <cmath>

#include "core/linear/kernel_table.hpp"

namespace mbsopt {

TangentSweep::TangentSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           std::span<const Cost> costs, const TangentSampling& sampling,
                           const Eigen::MatrixXd& y_initial_rho, bool watched, Eigen::MatrixXd& psi_rho)
    : Sweep(mechanism, settings, method, costs, watched), sampling_(sampling), psi_rho_(psi_rho) {
  const MechanismData& d = mechanism.data();
  const Eigen::Index states = mechanism.states();
  for (int i = 0; i < rk_.dense_stages; ++i) of_stage_.push_back(integrated(rk_.A + i * rk_.dense_stages));
  std::array<double, Method::kMaxStages> b_of_all{};
  std::copy_n(rk_.b, rk_.stages, b_of_all.begin());
  of_step_ = integrated(b_of_all.data());
  if (rk_.gamma) {
    for (int i = 0; i < rk_.stages; ++i) {
      std::array<double, Method::kMaxStages> of_k{};
      for (int j = 0; j < i; ++j) of_k[at(j)] = rk_.gamma_of(i, j) / rk_.gamma_of(0, 0);
      of_s_.push_back(integrated(of_k.data()));
    }
    a_.setZero(states / 2, kLanes);
    for (LaneRows* x : {&s_, &zero_}) x->setZero(states, kLanes);
  }
  const int coupled = largest_implicit_group(rk_);
  for (ParameterBlock& p : parameter_blocks(d)) {
    Block b;
    b.parameters = std::move(p);
    for (LaneRows* x : {&b.y0, &b.y_hat, &b.y1, &b.Y}) x->setZero(states, kLanes);
    b.a.assign(at(rk_.dense_stages), LaneRows::Zero(states / 2, kLanes));
    b.Y_stage.assign(at(coupled), LaneRows::Zero(states, kLanes));
    b.x.setZero(rk_.gamma ? states : coupled * StageEquations::count(d), kLanes);
    if (rk_.gamma) b.common.setZero(states / 2, kLanes);
    for (int k = 0; k < kLanes; ++k)
      if (const int of = b.parameters.parameter[k]; of >= 0) b.y0.col(k) = y_initial_rho.col(of);
    blocks_.push_back(std::move(b));
  }
  ydot_.setZero(states);
  seen_.reserve(static_cast<std::size_t>(states));
  r_.setZero(StageEquations::count(d), kLanes);
  y_rho_.setZero(states, d.rho.size());
}

TangentSweep::Weights TangentSweep::integrated(const double* of_k) const {
  Weights w;
  for (int i = 0; i < rk_.dense_stages; ++i) {
    w.c += of_k[i];
    w.v[at(i)] = of_k[i];
    for (int j = 0; j < rk_.dense_stages; ++j) w.q[at(j)] += of_k[i] * rk_.beta(i, j);
  }
  return w;
}

void TangentSweep::add_stages(const Block& b, double h, double c, const Weights& w, int first, int last,
                              const LaneRows& from, LaneRows& to) {
  const Eigen::Index half = from.size() / 2;
  const double* k[Method::kMaxStages + 1];
  double of_q[Method::kMaxStages + 1], of_v[Method::kMaxStages + 1];
  int terms = 0;
  const auto add = [&](double q, double v, const double* of_stage) {
    if (q == 0 && v == 0) return;
    of_q[terms] = q;
    of_v[terms] = v;
    k[terms++] = of_stage;
  };
  add(h * c, 0, b.y0.data() + half);
  for (int j = first; j <= last; ++j) {
    add(h * h * w.q[at(j)], h * w.v[at(j)], b.a[at(j)].data());
  }
  block_kernels().sum_stages(static_cast<std::size_t>(half / kLanes), terms, k, of_q, of_v, from.data(),
                             from.data() + half, to.data(), to.data() + half);
}

void TangentSweep::add_gradient(LaneRows Block::*direction, Eigen::Index objective) {
  psi_rho_.row(objective) += g_.rho.transpose();
  seen_.clear();  // most objectives look at few bodies
  for (Eigen::Index i = 0; i < g_.y.size(); ++i)
    if (g_.y(i) != 0) seen_.push_back(i);
  for (const Block& b : blocks_) {
    Lanes<1> change = Lanes<1>::Zero();
    for (const Eigen::Index i : seen_) change += g_.y(i) * (b.*direction).row(i);
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0) psi_rho_(objective, p) += change(k);
  }
}

void TangentSweep::set_inside(const Step& step, double theta) {
  std::array<double, Method::kMaxStages> of_k{};
  for (int i = 0; i < rk_.dense_stages; ++i) of_k[at(i)] = rk_.dense_weight(i, theta);
  const Weights w = integrated(of_k.data());
  for (Block& b : blocks_) add_stages(b, step.h, w.c, w, 0, rk_.dense_stages - 1, b.y0, b.Y);
}

void TangentSweep::take_samples(const Step& step, std::span<const SampleEvent> events) {
  for (const SampleEvent& e : events) {
    const double theta = (e.time - step.t) / step.h;
    dense_output(rk_, step, theta, y_);
    set_inside(step, theta);
    const double blend = projection_blend(theta);
    for (Block& b : blocks_) b.Y += blend * (b.y1 - b.y_hat);
    StatePoint here{e.time, y_, step.angles0, motion()};
    if (e.cost) {
      g_.set(*e.cost, here, 1);
      add_gradient(&Block::Y, e.objective);
      continue;
    }
    dense_output_rate(rk_, step, theta, ydot_);
    here.ydot = &ydot_;
    for (const Block& b : blocks_)
      for (int k = 0; k < kLanes; ++k)
        if (const int p = b.parameters.parameter[k]; p >= 0) y_rho_.col(p) = b.Y.col(k);
    sampling_.observe(e.index, here, y_rho_);
  }
}

bool TangentSweep::follow_explicit(const Step& step, int i) {
  if (!linearise_stage(step, i)) return false;
  const Weights& w = of_stage_[at(i)];
  for (Block& b : blocks_) {
    add_stages(b, step.h, w.c, w, 0, i - 1, b.y0, b.Y);
    dynamics_.acceleration_tangent(b.parameters, b.Y, b.a[at(i)]);
  }
  return true;
}

// Y_i' = Y*_i' + what the group's own accelerations add to it; they and their multipliers solve
//   N x' = r_y Y*_i' + r_rho
bool TangentSweep::follow_implicit(const Step& step, const StageGroup& g) {
  const Eigen::Index n = mechanism_.states() / 2, rows = StageEquations::count(mechanism_.data());
  for (int i = g.first; i <= g.last; ++i) {
    const int k = i - g.first;
    StageEquations& equations = implicit_->linearise(step, i, k);
    for (Block& b : blocks_) {
      add_stages(b, step.h, of_stage_[at(i)].c, of_stage_[at(i)], 0, g.first - 1, b.y0, b.Y_stage[at(k)]);
      equations.tangent(b.parameters, b.Y_stage[at(k)], r_);
      b.x.middleRows(k * rows, rows) = r_;
    }
  }
  if (!implicit_->factor(step.h, g)) return false;
  for (Block& b : blocks_) {
    implicit_->solve(g, b.x);
    for (int i = g.first; i <= g.last; ++i) b.a[at(i)] = b.x.middleRows((i - g.first) * rows, n);
    for (int i = g.first; i <= g.last; ++i) {
      LaneRows& Y = b.Y_stage[at(i - g.first)];
      add_stages(b, step.h, 0, of_stage_[at(i)], g.first, g.last, Y, Y);
    }
  }
  return true;
}

// h x_i' = inverse of (I - h g f_y) times the right-hand side of rosenbrock_stages.hpp, h a_i' its lower half less h
// s_i'
bool TangentSweep::follow_rosenbrock(const Step& step) {
  RosenbrockStages& rosenbrock = *rosenbrock_;
  const Eigen::Index n = mechanism_.states() / 2;
  const double h = step.h;
  if (!rosenbrock.factor(step)) return false;
  for (int k = RosenbrockStages::kPoints - 1; k >= 0; --k) {
    if (!rosenbrock.linearise_common(step, k)) return false;
    for (Block& b : blocks_) {
      dynamics_.acceleration_tangent(b.parameters, b.y0, a_);
      if (k == RosenbrockStages::kPoints - 1) b.common.setZero();
      b.common += rosenbrock.common_weight(k) * a_;
      if (k == 0) b.x.bottomRows(n) = a_;
    }
  }
  for (int i = 0; i < rk_.stages; ++i) {
    const std::size_t stage = at(i);
    if (i > 0 && !rosenbrock.linearise_stage(step, i)) return false;
    for (Block& b : blocks_) {
      if (i == 0) {
        b.Y = b.y0;
        a_ = b.x.bottomRows(n);
      } else {
        add_stages(b, h, of_stage_[stage].c, of_stage_[stage], 0, i - 1, b.y0, b.Y);
        dynamics_.acceleration_tangent(b.parameters, b.Y, a_);
      }
      b.x.topRows(n) = h * b.Y.bottomRows(n);
      b.x.bottomRows(n) = h * (a_ + rk_.gamma_sum[i] * b.common);
    }
    for (const int sign : {-1, 1}) {
      if (i == 0) break;  // w_0 = 0
      if (!rosenbrock.linearise_own(step, i, sign)) return false;
      for (Block& b : blocks_) {
        dynamics_.acceleration_tangent(b.parameters, b.y0, a_);
        b.x.bottomRows(n) += h * rosenbrock.own_weight(sign) * a_;
      }
    }
    for (Block& b : blocks_) {
      add_stages(b, h, of_s_[stage].c, of_s_[stage], 0, i - 1, zero_, s_);
      b.x += s_;
      rosenbrock.solve(b.x);
      b.a[stage] = (b.x.bottomRows(n) - s_.bottomRows(n)) / h;
    }
  }
  return true;
}

// At a node, where the directions are in Block::Y.
void TangentSweep::add_running_costs(const Step& step, int node) {
  node_state(rk_, step, node, y_);
  for (std::size_t o = 0; o < costs_.size(); ++o)
    if (set_running_gradient(step, o, node)) add_gradient(&Block::Y, static_cast<Eigen::Index>(o));
}

bool TangentSweep::follow(const Step& step, std::span<const SampleEvent> events) {
  if (rosenbrock_) {
    if (!follow_rosenbrock(step)) return false;
    for (int m = 0; m < rk_.nodes; ++m) {
      set_inside(step, rk_.node_c[m]);
      add_running_costs(step, m);
    }
  }
  for (const StageGroup& g : step.dense ? rk_.stage_groups() : rk_.stage_groups_of_step()) {
    if (rosenbrock_ || !is_used(rk_, g, step.dense)) continue;
    const bool implicit = is_implicit(rk_, g);
    if (!(implicit ? follow_implicit(step, g) : follow_explicit(step, g.first))) return false;
    for (int i = g.first; i <= g.last; ++i) {
      if (i >= rk_.stages || rk_.b[i] == 0) continue;
      if (implicit) {
        for (Block& b : blocks_) b.Y = b.Y_stage[at(i - g.first)];
      }
      add_running_costs(step, i);
    }
  }
  end_step(step);
  for (Block& b : blocks_) add_stages(b, step.h, of_step_.c, of_step_, 0, rk_.stages - 1, b.y0, b.y_hat);
  if (projector_->active()) {
    if (!projector_->linearise(step.t1, step.angles0, step.y_hat, step.y1, step.projection)) return false;
    for (Block& b : blocks_) projector_->tangent(b.parameters, b.y_hat, b.y1);
  } else {
    for (Block& b : blocks_) b.y1 = b.y_hat;
  }
  take_samples(step, events);
  const double largest_of_y = step.y1.cwiseAbs().maxCoeff();
  for (Block& b : blocks_) {
    b.y0 = b.y1;
    const Lanes<1> largest = b.y1.cwiseAbs().colwise().maxCoeff();
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0)
        magnification_ = std::max(magnification_, largest(k) * std::abs(mechanism_.rho()(p)) / largest_of_y);
  }
  return true;
}

void TangentSweep::cross_limit(Switches& switches, const SwitchEvent& event, const StatePoint& at) {
  if (!set_strike(switches, event, at)) return;
  const auto& [impact, f_before, f_after, r_y, r_rho, c_y, c_rho, e, slot_e] = strike_;
  const Eigen::Index n = impact.w.size();
  LaneRows a = LaneRows::Zero(n, kLanes);
  const auto add_parameters = [](const Block& b, const Eigen::VectorXd& of_rho, Lanes<1>& lanes) {
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0) lanes(k) += of_rho(p);
  };
  std::vector<Lanes<1>> dt;
  for (Block& b : blocks_) {
    Lanes<1>& here = dt.emplace_back(event_.g_y.transpose() * b.y0);
    add_parameters(b, event_.g_rho, here);
    here /= -event_.rate;
    b.y0 += f_before * here;
    b.Y.setZero();
  }
  for (const double sign : {1.0, -1.0}) {
    const bool linearised = linearise_pushed(switches, event, at, sign * impact.mu);
    for (Block& b : blocks_) {
      if (!linearised) break;
      dynamics_.acceleration_tangent(b.parameters, b.y0, a);
      b.Y.bottomRows(n) += sign / (2 * impact.mu) * a;
    }
    switches.push(event.of, 0);
  }
  auto moved = dt.begin();
  for (Block& b : blocks_) {
    const auto w = b.Y.bottomRows(n);
    Lanes<1> dr = r_y.transpose() * b.y0, dc = c_y.head(n).transpose() * b.y0.topRows(n) + c_y.tail(n).transpose() * w;
    add_parameters(b, r_rho, dr);
    add_parameters(b, c_rho, dc);
    Lanes<1> de = Lanes<1>::Zero(), storage;
    if (const Lanes<1>* const direction = b.parameters.field<1>(slot_e, storage)) de = *direction;
    const Lanes<1> dL = -((1 + e) * dr + impact.r * de + impact.Ln * dc) / impact.c;
    b.y0.bottomRows(n) += impact.Ln * w + impact.w * dL;
    b.y0 -= f_after * *moved;
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0) psi_rho_.col(p) += (*moved)(k)*event_.jump_of_costs;
    ++moved;
  }
}

void TangentSweep::cross(Switches& switches, const SwitchEvent& event, std::size_t first, const StatePoint& at) {
  if (switches.is_limit(event.of)) return cross_limit(switches, event, at);
  if (!set_event(switches, event, first, at, false)) return;
  for (Block& b : blocks_) {
    Lanes<1> dt = event_.g_y.transpose() * b.y0;
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0) dt(k) += event_.g_rho(p);
    dt /= -event_.rate;
    b.y0 += event_.jump * dt;
    for (int k = 0; k < kLanes; ++k)
      if (const int p = b.parameters.parameter[k]; p >= 0) psi_rho_.col(p) += dt(k) * event_.jump_of_costs;
  }
}

void TangentSweep::finish(const StatePoint& end) {
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (!costs_[o].terminal) continue;
    g_.set(*costs_[o].terminal, end, 1);
    add_gradient(&Block::y0, static_cast<Eigen::Index>(o));
  }
}

}  // namespace mbsopt
