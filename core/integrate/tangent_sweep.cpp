#include "core/integrate/tangent_sweep.hpp"

#include "core/integrate/model_choice.hpp"

namespace mbsopt {
namespace {

// Y = y0 + h sum_j w(j) K_j, over j < count.
template <class Weight>
void combine(const LaneRows& y0, double h, int count, Weight&& w, const std::vector<LaneRows>& K, LaneRows& Y) {
  StageSum sum;
  for (int j = 0; j < count; ++j) sum.add(h * w(j), K[static_cast<std::size_t>(j)].data());
  sum.to(y0.data(), Y.data(), Y.size());
}

}  // namespace

TangentSweep::TangentSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           const Eigen::MatrixXd& y_initial_rho)
    : mechanism_(mechanism),
      rk_(method),
      dynamics_(mechanism, settings.formulation, model_of(mechanism, settings, method)),
      projector_(mechanism, settings.formulation.projection, model_of(mechanism, settings, method)) {
  const MechanismData& d = mechanism.data();
  if (d.needs_motion) motion_.emplace(mechanism, settings.formulation);
  const Eigen::Index states = mechanism.states();
  const int coupled = largest_implicit_group(rk_);
  if (coupled > 0) implicit_.emplace(d, rk_);
  for (ParameterBlock& p : parameter_blocks(d)) {
    Block b;
    b.parameters = std::move(p);
    for (LaneRows* x : {&b.y0, &b.y_hat, &b.y1, &b.Y}) x->setZero(states, kLanes);
    b.K.assign(static_cast<std::size_t>(rk_.dense_stages), LaneRows::Zero(states, kLanes));
    b.Y_stage.assign(static_cast<std::size_t>(coupled), LaneRows::Zero(states, kLanes));
    b.x.setZero(coupled * dynamics_.equations(), kLanes);
    for (int k = 0; k < kLanes; ++k) {
      if (b.parameters.parameter[k] >= 0) b.y0.col(k) = y_initial_rho.col(b.parameters.parameter[k]);
    }
    blocks_.push_back(std::move(b));
  }
  y_.setZero(states), ydot_.setZero(states), y_bar_.setZero(states);
  rho_bar_.setZero(d.rho.size());
  r_.setZero(dynamics_.equations(), kLanes);
  y_rho_.setZero(states, d.rho.size());
}

void TangentSweep::add_cost(const PointCost& cost, const StatePoint& at, double weight, LaneRows Block::*direction,
                            Eigen::Index objective, Eigen::MatrixXd& psi_rho) {
  y_bar_.setZero();
  rho_bar_.setZero();
  cost.add_gradient(at, weight, y_bar_, rho_bar_);
  psi_rho.row(objective) += rho_bar_.transpose();
  for (const Block& b : blocks_) {
    const Lanes<1> change = y_bar_.transpose() * (b.*direction);
    for (int k = 0; k < kLanes; ++k) {
      if (b.parameters.parameter[k] >= 0) psi_rho(objective, b.parameters.parameter[k]) += change(k);
    }
  }
}

void TangentSweep::set_dense(const Step& step, double theta) {
  const double blend = projection_blend(theta);
  for (Block& b : blocks_) {
    b.Y = b.y0 + blend * (b.y1 - b.y_hat);
    combine(
        b.Y, step.h, rk_.dense_stages, [&](int i) { return rk_.dense_weight(i, theta); }, b.K, b.Y);
  }
}

void TangentSweep::take_samples(const Step& step, std::span<const SampleEvent> events, const TangentSampling& sampling,
                                Eigen::MatrixXd& psi_rho) {
  for (const SampleEvent& e : events) {
    const double theta = (e.time - step.t) / step.h;
    dense_output(rk_, step, theta, y_);
    set_dense(step, theta);
    StatePoint at{e.time, y_, step.angles0, motion()};
    if (e.cost) {
      add_cost(*e.cost, at, 1, &Block::Y, e.objective, psi_rho);
    } else {
      dense_output_rate(rk_, step, theta, ydot_);
      at.ydot = &ydot_;
      for (const Block& b : blocks_) {
        for (int k = 0; k < kLanes; ++k) {
          if (b.parameters.parameter[k] >= 0) y_rho_.col(b.parameters.parameter[k]) = b.Y.col(k);
        }
      }
      sampling.observe(e.index, at, y_rho_);
    }
  }
}

bool TangentSweep::follow_explicit(const Step& step, int i) {
  y_ = step.Y.col(i);
  const auto a_i = step.K.col(i).tail(mechanism_.states() / 2);
  if (!dynamics_.linearise(step.t + rk_.c[i] * step.h, y_, step.angles0, a_i, step.lambda.col(i))) return false;
  for (Block& b : blocks_) {
    combine(
        b.y0, step.h, i, [&](int j) { return rk_.a(i, j); }, b.K, b.Y);
    dynamics_.tangent(b.parameters, b.Y, b.K[static_cast<std::size_t>(i)]);
  }
  return true;
}

// Y_i' = Y*_i' + h sum_j A_ij k_j' over the group's own stages j; their accelerations and multipliers solve
//   N x' = r_y (Q*_i' + h sum_j A_ij V*_j', V*_i') + r_rho
bool TangentSweep::follow_implicit(const Step& step, const StageGroup& g) {
  const Eigen::Index n = mechanism_.states() / 2, rows = dynamics_.equations();
  for (Block& b : blocks_) {
    for (int i = g.first; i <= g.last; ++i) {
      LaneRows& Y = b.Y_stage[static_cast<std::size_t>(i - g.first)];
      combine(
          b.y0, step.h, g.first, [&](int j) { return rk_.a(i, j); }, b.K, Y);
    }
    for (int i = g.first; i <= g.last; ++i) {
      for (int j = g.first; j <= g.last; ++j) {
        b.Y_stage[static_cast<std::size_t>(i - g.first)].topRows(n) +=
            (step.h * rk_.a(i, j)) * b.Y_stage[static_cast<std::size_t>(j - g.first)].bottomRows(n);
      }
    }
  }
  for (int i = g.first; i <= g.last; ++i) {
    y_ = step.Y.col(i);
    dynamics_.place_at(step.t + rk_.c[i] * step.h, y_, step.angles0, step.K.col(i).tail(n), step.lambda.col(i));
    implicit_->linearise(dynamics_, i - g.first);
    for (Block& b : blocks_) {
      dynamics_.residual_tangent(b.parameters, b.Y_stage[static_cast<std::size_t>(i - g.first)], r_);
      b.x.middleRows((i - g.first) * rows, rows) = r_;
    }
  }
  if (!implicit_->factor(step.h, g)) return false;
  for (Block& b : blocks_) {
    implicit_->solve(g, b.x);
    for (int i = g.first; i <= g.last; ++i) {
      LaneRows& K = b.K[static_cast<std::size_t>(i)];
      K.bottomRows(n) = b.x.middleRows((i - g.first) * rows, n);
      K.topRows(n) = b.Y_stage[static_cast<std::size_t>(i - g.first)].bottomRows(n);
    }
    for (int i = g.first; i <= g.last; ++i) {  // V_i'
      LaneRows& Y = b.Y_stage[static_cast<std::size_t>(i - g.first)];
      for (int j = g.first; j <= g.last; ++j) {
        Y.bottomRows(n) += (step.h * rk_.a(i, j)) * b.K[static_cast<std::size_t>(j)].bottomRows(n);
      }
    }
    // Q_i' has h sum A_ij V*_j' already; what the group's accelerations add to V_j' comes to it.
    for (int i = g.first; i <= g.last; ++i) {
      LaneRows& Y = b.Y_stage[static_cast<std::size_t>(i - g.first)];
      for (int j = g.first; j <= g.last; ++j) {
        const LaneRows& K = b.K[static_cast<std::size_t>(j)];
        Y.topRows(n) +=
            (step.h * rk_.a(i, j)) * (b.Y_stage[static_cast<std::size_t>(j - g.first)].bottomRows(n) - K.topRows(n));
      }
    }
    for (int i = g.first; i <= g.last; ++i) {
      b.K[static_cast<std::size_t>(i)].topRows(n) = b.Y_stage[static_cast<std::size_t>(i - g.first)].bottomRows(n);
    }
  }
  return true;
}

void TangentSweep::add_running_costs(const Step& step, int i, std::span<const Cost> costs, Eigen::MatrixXd& psi_rho) {
  y_ = step.Y.col(i);
  for (std::size_t o = 0; o < costs.size(); ++o) {
    if (!costs[o].running) continue;
    add_cost(*costs[o].running, {step.t + rk_.c[i] * step.h, y_, step.angles0, motion()}, step.h * rk_.b[i], &Block::Y,
             static_cast<Eigen::Index>(o), psi_rho);
  }
}

bool TangentSweep::follow(const Step& step, std::span<const Cost> costs, std::span<const SampleEvent> events,
                          const TangentSampling& sampling, Eigen::MatrixXd& psi_rho) {
  for (const StageGroup& g : step.dense ? rk_.stage_groups() : rk_.stage_groups_of_step()) {
    if (!is_used(rk_, g, step.dense)) continue;
    const bool implicit = is_implicit(rk_, g);
    if (!(implicit ? follow_implicit(step, g) : follow_explicit(step, g.first))) return false;
    for (int i = g.first; i <= g.last; ++i) {
      if (i >= rk_.stages || rk_.b[i] == 0) continue;
      if (implicit) {
        for (Block& b : blocks_) b.Y = b.Y_stage[static_cast<std::size_t>(i - g.first)];
      }
      add_running_costs(step, i, costs, psi_rho);
    }
  }
  for (Block& b : blocks_) {
    combine(
        b.y0, step.h, rk_.stages, [&](int j) { return rk_.b[j]; }, b.K, b.y_hat);
  }
  if (projector_.active()) {
    if (!projector_.linearise(step.t1, step.angles0, step.y_hat, step.y1, step.projection)) return false;
    for (Block& b : blocks_) projector_.tangent(b.parameters, b.y_hat, b.y1);
  } else {
    for (Block& b : blocks_) b.y1 = b.y_hat;
  }
  take_samples(step, events, sampling, psi_rho);
  for (Block& b : blocks_) b.y0 = b.y1;
  return true;
}

void TangentSweep::finish(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                          std::span<const Cost> costs, Eigen::MatrixXd& psi_rho) {
  for (std::size_t o = 0; o < costs.size(); ++o) {
    if (!costs[o].terminal) continue;
    add_cost(*costs[o].terminal, {t, y, angles, motion()}, 1, &Block::y0, static_cast<Eigen::Index>(o), psi_rho);
  }
}

}  // namespace mbsopt
