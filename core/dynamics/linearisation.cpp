// Derivatives of b = f - M z - J'lambda and c = -(J z + gamma), z and lambda held fixed: in the state as blocks, in the
// fields and parameters as directions.
#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/dynamics/dynamics.hpp"
#include "core/dynamics/space.hpp"

namespace mbsopt {
const MotionBlocks& Dynamics::blocks() {
  const double two_xi_omega = 2 * settings_.xi * settings_.omega, omega2 = settings_.omega * settings_.omega;
  if (!linear_) {
    MotionBlocks empty(data_);
    ConstraintBlocks constraints(data_, empty, two_xi_omega, omega2);
    std::vector<bool> reads_units(frames_.size(), false);
    constraints.mark_units(reads_units);
    forces_.mark_units(reads_units);
    std::vector<std::size_t> bodies;
    for (std::size_t i = 1; i < reads_units.size(); ++i) {
      if (reads_units[i]) bodies.push_back(i);
    }
    std::vector<UnitTangents> units(bodies.empty() ? 0 : bodies.back() + 1);
    linear_.emplace(
        Linearisation{std::move(empty), std::move(constraints), std::move(units), std::move(bodies), false});
  }
  Linearisation& x = *linear_;
  if (x.current) return x.blocks;
  x.current = true;
  x.blocks.set_zero();
  for (const std::size_t i : x.bodies_of_units) set_unit_tangents(bodies_[i], x.units[i]);
  x.constraints.add(bodies_, frames_, x.units, lambda_, x.blocks);
  forces_.add_blocks(here(), x.units, x.blocks);
  if (!data_.user_forces.empty()) add_user_blocks(x.blocks);
  for (int i = 0; i < data_.n; ++i) {
    // -(omega x J omega)' = (skew(J omega) - skew(omega) J) omega',   omega' = 2 (G(p) pdot' - G(pdot) p')
    const std::size_t k = static_cast<std::size_t>(i) + 1;
    const BodyState& body = bodies_[k];
    const Matrix3d& J = data_.bodies[k].J;
    const Vector3d omega = body.omega();
    const Matrix3d by_omega = 2 * (skew(J * omega) - skew(omega) * J);
    MotionBlocks::Block<6>& block = x.blocks.b[static_cast<std::size_t>(x.blocks.pair(i, i))];
    block.q.block<3, 4>(3, 3) -= by_omega * G(body.pdot);
    block.v.block<3, 4>(3, 3) += by_omega * G(body.p);
    block.parts |= MotionBlocks::p | MotionBlocks::pdot;
  }
  return x.blocks;
}

void Dynamics::right_hand_side_tangent(const ParameterBlock& block, const LaneRows& y_dir) {
  for (Lanes<6>& load : load_dirs_) load.setZero();
  constraints_.field_tangents(frames_, laws_, angles_, block, lambda_, constraint_dirs_, load_dirs_);
  for (Lanes<6>& load : load_dirs_) load = -load;  // from (J'lambda)' to its share of the right-hand side
  forces_.add_field_tangent(here(), block, load_dirs_);
  if (!data_.user_forces.empty()) add_user_field_tangent(block);

  Lanes<3> gravity_dir;
  const Lanes<3>* dg = block.field<3>(data_.slot_gravity, gravity_dir);
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const BodyData& body = data_.bodies[k];
    Lanes<6>& b = rhs_lanes_[k - 1];
    b = load_dirs_[k];
    Vec<6> x = z_[k - 1];
    x.head<3>() -= data_.gravity;
    InSpace::subtract_mass_tangent(data_, k, block, x, b);
    if (dg) b.topRows<3>() += body.mass * *dg;
    Lanes<6> J_dir;
    if (const Lanes<6>* dJ = block.field<6>(body.slot_J, J_dir)) {
      const Vector3d omega = bodies_[k].omega();
      b.bottomRows<3>() -= cross(omega, inertia_tangent_times(*dJ, omega));
    }
  }
  gamma_dir_ = -constraint_dirs_.phi_ddot;
  if (settings_.omega != 0) {
    gamma_dir_ -= 2 * settings_.xi * settings_.omega * constraint_dirs_.phi_dot +
                  settings_.omega * settings_.omega * constraint_dirs_.phi;
  }
  blocks().add_times(y_dir, rhs_lanes_, gamma_dir_);
}

}  // namespace mbsopt
