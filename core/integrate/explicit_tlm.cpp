#include "core/integrate/explicit_tlm.hpp"

#include "core/body/euler_parameters.hpp"

namespace mbsopt {

void set_z(const Eigen::VectorXd& y, const Eigen::Ref<const Eigen::VectorXd>& a, std::vector<Vec<6>>& z) {
  for (std::size_t i = 0; i < z.size(); ++i) {
    const Eigen::Index q = 7 * static_cast<Eigen::Index>(i);
    const Vector4d p = y.segment<4>(q + 3);
    z[i].head<3>() = a.segment<3>(q);
    z[i].tail<3>() = (2 / p.squaredNorm()) * G_times(p, a.segment<4>(q + 3));
  }
}

TangentSweep::TangentSweep(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
                           const Eigen::MatrixXd& y_initial_rho)
    : mechanism_(mechanism),
      rk_(method),
      dynamics_(mechanism, settings.formulation),
      projector_(mechanism, settings.formulation.projection) {
  const MechanismData& d = mechanism.data();
  if (d.needs_motion) motion_.emplace(mechanism, settings.formulation);
  const Eigen::Index states = mechanism.states();
  for (ParameterBlock& p : parameter_blocks(d)) {
    Block b;
    b.parameters = std::move(p);
    for (LaneRows* x : {&b.y0, &b.y_hat, &b.y1, &b.Y}) x->setZero(states, kLanes);
    b.K.assign(static_cast<std::size_t>(rk_.dense_stages), LaneRows::Zero(states, kLanes));
    for (int k = 0; k < kLanes; ++k) {
      if (b.parameters.parameter[k] >= 0) b.y0.col(k) = y_initial_rho.col(b.parameters.parameter[k]);
    }
    blocks_.push_back(std::move(b));
  }
  z_.resize(static_cast<std::size_t>(d.n));
  y_.setZero(states), y_bar_.setZero(states);
  rho_bar_.setZero(d.rho.size());
  lambda_.setZero(d.m);
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
    for (int i = 0; i < rk_.dense_stages; ++i) {
      const double w = rk_.dense_weight(i, theta);
      if (w != 0) b.Y += (step.h * w) * b.K[static_cast<std::size_t>(i)];
    }
  }
}

void TangentSweep::take_samples(const Step& step, std::span<const SampleEvent> events, const TangentSampling& sampling,
                                Eigen::MatrixXd& psi_rho) {
  for (const SampleEvent& e : events) {
    const double theta = (e.time - step.t) / step.h;
    dense_output(rk_, step, theta, y_);
    set_dense(step, theta);
    const StatePoint at{e.time, y_, step.angles0, motion()};
    if (e.cost) {
      add_cost(*e.cost, at, 1, &Block::Y, e.objective, psi_rho);
    } else {
      for (const Block& b : blocks_) {
        for (int k = 0; k < kLanes; ++k) {
          if (b.parameters.parameter[k] >= 0) y_rho_.col(b.parameters.parameter[k]) = b.Y.col(k);
        }
      }
      sampling.observe(e.index, at, y_rho_);
    }
  }
}

bool TangentSweep::follow(const Step& step, std::span<const Cost> costs, std::span<const SampleEvent> events,
                          const TangentSampling& sampling, Eigen::MatrixXd& psi_rho) {
  const Eigen::Index half = mechanism_.states() / 2;
  for (int i = 0; i < step.stages(rk_); ++i) {
    const bool in_step = i < rk_.stages && rk_.b[i] != 0;
    bool needed = in_step || step.dense;
    for (int j = i + 1; j < step.stages(rk_) && !needed; ++j) needed = rk_.a(j, i) != 0;
    if (!needed) continue;
    y_ = step.Y.col(i);
    set_z(y_, step.K.col(i).tail(half), z_);
    lambda_ = step.lambda.col(i);
    const double t = step.t + rk_.c[i] * step.h;
    if (!dynamics_.linearise(t, y_, step.angles0, z_, lambda_)) return false;
    for (Block& b : blocks_) {
      b.Y = b.y0;
      for (int j = 0; j < i; ++j) {
        const double a = rk_.a(i, j);
        if (a != 0) b.Y += (step.h * a) * b.K[static_cast<std::size_t>(j)];
      }
      dynamics_.tangent(b.parameters, b.Y, b.K[static_cast<std::size_t>(i)]);
    }
    if (!in_step) continue;
    for (std::size_t o = 0; o < costs.size(); ++o) {
      if (!costs[o].running) continue;
      add_cost(*costs[o].running, {t, y_, step.angles0, motion()}, step.h * rk_.b[i], &Block::Y,
               static_cast<Eigen::Index>(o), psi_rho);
    }
  }
  for (Block& b : blocks_) {
    b.y_hat = b.y0;
    for (int i = 0; i < rk_.stages; ++i) {
      if (rk_.b[i] != 0) b.y_hat += (step.h * rk_.b[i]) * b.K[static_cast<std::size_t>(i)];
    }
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
