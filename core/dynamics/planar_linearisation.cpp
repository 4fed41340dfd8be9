// Tangents of the planar equations: right-hand sides and accelerations in directions of the state and the parameters.
#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/planar_dynamics.hpp"
#include "core/dynamics/space.hpp"
#include "core/force/forces.hpp"
#include "core/linear/pairs.hpp"

namespace mbsopt {
namespace {

// The blocks of forces alone.
MotionBlocks force_blocks(MechanismData data) {
  data.constraints.clear();
  data.m = 0;
  return MotionBlocks(data);
}

}  // namespace

// The directions are P' and Pdot'. Products are those of complex numbers and real dot products:
//   Addot' = 4 Pdot Pdot' + (i omegadot - 2 |Pdot|^2) 2 P P' - 4 (Pdot'Pdot') A
//   Pddot' = (i omegadot/2 - |Pdot|^2) P' - 2 (Pdot'Pdot') P        and with omegadot':  + i omegadot'/2 P
void PlanarDynamics::prepare_tangents() {
  tangents_ready_ = true;
  constraints_.set_point_moments(lambda_, moments_);
  const auto product = [](const Plane& g, auto&& block) { block << g.re, -g.im, g.im, g.re; };
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    const Plane &A = frames_[k].A, &P = b.P, &Pdot = b.Pdot;
    const double size = squared_norm(Pdot);
    TurnTangent& x = turns_[k];
    x.moment = conj(2 * P) * moments_[k];
    product(2 * (Plane{-2 * size, b.omegadot} * P), x.Addot.leftCols<2>());
    product(4 * Pdot, x.Addot.rightCols<2>());
    product(Plane{-size, 0.5 * b.omegadot}, x.Pddot.leftCols<2>());
    const Eigen::RowVector2d along(Pdot.re, Pdot.im);
    x.Addot.row(0).tail<2>() -= 4 * A.re * along, x.Addot.row(1).tail<2>() -= 4 * A.im * along;
    x.Pddot.row(0).tail<2>() = -2 * P.re * along, x.Pddot.row(1).tail<2>() = -2 * P.im * along;
  }
  if (!loaded_.empty()) prepare_force_tangents();
}

// The blocks of forces, reduced to the plane.
void PlanarDynamics::prepare_force_tangents() {
  if (!force_linearisation_) {
    force_linearisation_.emplace(
        ForceLinearisation{force_blocks(data_), std::vector<UnitTangents>(bodies_.size()), {}});
    force_linearisation_->in_plane.resize(force_linearisation_->blocks.b.size());
  }
  ForceLinearisation& x = *force_linearisation_;
  for (ForceLinearisation::Block& block : x.in_plane) block = {};
  if (torques_.lie_in_plane()) add_torque_blocks();
  if (springs_in_plane_) add_spring_blocks();
  if (only_torques_ && springs_in_plane_ == has_springs_) return;
  if (!in_space_) place_in_space();
  x.blocks.set_zero();
  for (const std::size_t k : loaded_) set_unit_tangents(frames_in_space_[k], x.units[k]);
  forces_.add_blocks(here(), x.units, x.blocks, springs_in_plane_, torques_.lie_in_plane());
  user_.add_blocks(here(), no_mass_terms_, x.blocks);
  for (std::size_t k = 0; k < x.in_plane.size(); ++k) {
    const MotionBlocks::Block<6>& block = x.blocks.b[k];
    if (block.parts == 0) continue;
    const MotionBlocks::Place& place = x.blocks.pairs()[k];
    const PlanarBody &loaded = model_.bodies[at(place.row + 1)], &read = model_.bodies[at(place.body + 1)];
    const auto in_plane = [&](const Mat<6, 7>& of) {
      Mat<3, 7> rows;
      rows << of.row(model_.t1), of.row(model_.t2), loaded.n.transpose() * of.bottomRows<3>();
      return rows;
    };
    const auto reduce = [&](const Mat<3, 7>& rows) {
      Mat<3, 4> to;
      to << rows.col(model_.t1), rows.col(model_.t2), rows.rightCols<4>() * read.p_a, rows.rightCols<4>() * read.p_b;
      return to;
    };
    const Mat<3, 7> q = in_plane(block.q);
    ForceLinearisation::Block& to = x.in_plane[k];
    to.q += reduce(q);
    to.v += reduce(in_plane(block.v));
    to.height += q.col(model_.n);
    to.filled = true;
  }
}

// A torque about a hinge loads the bodies at its ends by -+f(x, xdot), where x = +-(theta_2 - theta_1):
//   moment_i' = -s_i sum_j s_j (f_x theta_j' + f_xdot omega_j'),   s = -1 for body 1, 1 for body 2
//   theta' = Im(2 P'/P),   omega' = Im(2 Pdot'/P - 2 Pdot P'/P^2)
// A free torque c has the moment |P|^2 c_n. These numbers equal those of space, also off the constraints.
void PlanarDynamics::add_torque_blocks() {
  ForceLinearisation& x = *force_linearisation_;
  const auto add = [&](const auto& torque, const Law::Value& f) {
    for (const int read : torque.bodies()) {
      if (read == 0) continue;
      const Body& b = bodies_[at(read)];
      const Plane over = inverse(b.P), theta = 2 * over, omega = -(theta * (b.Pdot * over));
      for (const int loaded : torque.bodies()) {
        if (loaded == 0) continue;
        const double sign = loaded == read ? -1 : 1;
        const Plane by_P = sign * (f.f_x * theta + f.f_xdot * omega), by_Pdot = (sign * f.f_xdot) * theta;
        ForceLinearisation::Block& block = x.in_plane[at(x.blocks.pair(loaded, read))];
        block.q.row(2).tail<2>() += Eigen::RowVector2d(by_P.im, by_P.re);
        block.v.row(2).tail<2>() += Eigen::RowVector2d(by_Pdot.im, by_Pdot.re);
        block.filled = true;
      }
    }
  };
  torques_.for_each_hinge(here(), frames_, forces_.law_scratch(), add);
  forces_.for_each_free_torque(here(), [&](std::size_t body, const Vector3d& c) {
    const Plane& P = bodies_[body].P;
    const int own = static_cast<int>(body);
    ForceLinearisation::Block& block = x.in_plane[at(x.blocks.pair(own, own))];
    block.q.row(2).tail<2>() += 2 * c(model_.n) * Eigen::RowVector2d(P.re, P.im);
    block.filled = true;
  });
}

// Point b of a spring is at r + A s with A = P^2, so that, with the signs -1 for body 1 and 1 for body 2,
//   d' = sum sign (r' + 2 P s P'),   ddot' = sum sign (rdot' + 2 Pdot s P' + 2 P s Pdot')
// Body 1 is loaded by (F, A s x F), body 2 by the opposite, where F' = K d' + C ddot' and the arm A s turns with P'.
void PlanarDynamics::add_spring_blocks() {
  ForceLinearisation& x = *force_linearisation_;
  const auto product = [](const Plane& g) {
    Mat<2, 2> block;
    block << g.re, -g.im, g.im, g.re;
    return block;
  };
  for (std::size_t k = 0; k < springs_.count(); ++k) {
    const PlanarTension spring = springs_.tension(k, t_, frames_, forces_.law_scratch());
    for (const bool read_first : {true, false}) {
      const std::size_t read = read_first ? spring.body1 : spring.body2;
      if (read == 0) continue;
      const double sign = read_first ? -1 : 1;
      const Plane s = read_first ? spring.s1 : spring.s2, by_P = 2 * (bodies_[read].P * s);
      Mat<2, 4> by_q, by_v;  // of F
      by_q << spring.K, spring.K * product(by_P) + spring.C * product(2 * (bodies_[read].Pdot * s));
      by_v << spring.C, spring.C * product(by_P);
      for (const bool load_first : {true, false}) {
        const std::size_t loaded = load_first ? spring.body1 : spring.body2;
        if (loaded == 0) continue;
        const Plane arm = frames_[loaded].A * (load_first ? spring.s1 : spring.s2);
        const double factor = load_first ? sign : -sign;
        const Eigen::RowVector2d across(-arm.im, arm.re);
        ForceLinearisation::Block& block =
            x.in_plane[at(x.blocks.pair(static_cast<int>(loaded), static_cast<int>(read)))];
        block.q.topRows<2>() += factor * by_q;
        block.q.row(2) += factor * across * by_q;
        block.v.topRows<2>() += factor * by_v;
        block.v.row(2) += factor * across * by_v;
        block.filled = true;
        if (loaded != read) continue;
        const Plane turned = conj(by_P) * spring.F;  // (g P') x F = Im(conj(g P') F)
        block.q.row(2).tail<2>() += -sign * Eigen::RowVector2d(turned.im, -turned.re);
      }
    }
  }
}

// Adds the tangent of the forces to b: in the state by their blocks, and in the fields.
void PlanarDynamics::add_force_tangent(const ParameterBlock& block, const LaneRows& y_dir) {
  const StateLayout layout{data_.n};
  const ForceLinearisation& x = *force_linearisation_;
  const LaneRow* y = entries(y_dir);
  for (std::size_t k = 0; k < x.in_plane.size(); ++k) {
    if (!x.in_plane[k].filled) continue;
    const MotionBlocks::Place& place = x.blocks.pairs()[k];
    const std::size_t read = at(place.body + 1);
    const LaneRow* r = y + layout.q(read);
    const LaneRow* rdot = y + layout.v(read);
    const LaneRow* P = entries(turn_dirs_[read]);
    LaneRow* b = entries(rhs_lanes_[at(place.row)]);
    const Mat<3, 4>&q = x.in_plane[k].q, &v = x.in_plane[k].v;
    const Vec<3>& height = x.in_plane[k].height;
    for (int i = 0; i < 3; ++i) {
      b[i] += q(i, 0) * r[model_.t1] + q(i, 1) * r[model_.t2] + q(i, 2) * P[0] + q(i, 3) * P[1] +
              v(i, 0) * rdot[model_.t1] + v(i, 1) * rdot[model_.t2] + v(i, 2) * P[2] + v(i, 3) * P[3] +
              height(i) * r[model_.n];
    }
  }
  if (torques_.are_all() && !has_springs_)
    return torques_.add_field_tangent(here(), frames_, forces_, block, rhs_lanes_);
  if (!in_space_) place_in_space();
  for (const std::size_t k : loaded_) body_load_dirs_[k].setZero();
  body_load_dirs_[0].setZero();
  forces_.add_field_tangent(here(), block, body_load_dirs_);
  user_.add_field_tangent(here(), no_mass_terms_, block, body_load_dirs_);
  for (const std::size_t k : loaded_) rhs_lanes_[k - 1] += bodies_in_y_.reduced(k, body_load_dirs_[k]);
}

// Adds the tangents of laws and of all constraints except points, by dual numbers.
void PlanarDynamics::add_other_tangents(const ParameterBlock& block, const LaneRows& y_dir) {
  using RowOrder = PlanarConstraints::Order;
  const StateLayout layout{data_.n};
  for (const std::size_t k : dual_bodies_) {
    const Body& b = bodies_[k];
    PlanarFrame<Dual>& f = dual_frames_[k];
    f.r = bodies_in_y_.vector(frames_[k].r, y_dir, layout.q(k));
    f.rdot = bodies_in_y_.vector(frames_[k].rdot, y_dir, layout.v(k));
    f.rddot = frames_[k].rddot;
    const auto turn = [&](const Plane& value, Eigen::Index row) {
      return PlaneDual{dual(value.re, turn_dirs_[k].row(row)), dual(value.im, turn_dirs_[k].row(row + 1))};
    };
    f.set_turn(turn(b.P, 0), turn(b.Pdot, 2), b.omegadot);
  }
  const auto add = [&](RowOrder order, double factor, const LaneRows& rows, std::vector<Lanes<3>>& loads) {
    for (Lanes<3>& load : loads) load.setZero();
    constraints_.tangents(order, dual_frames_, laws_, angles_, block, lambda_, constraint_dirs_, loads);
    gamma_dir_ -= factor * rows;
  };
  if (formulation_.omega != 0) {
    add(RowOrder::phi, formulation_.omega * formulation_.omega, constraint_dirs_.phi, load_dirs_);
    add(RowOrder::phi_dot, 2 * formulation_.xi * formulation_.omega, constraint_dirs_.phi_dot, load_dirs_);
  }
  add(RowOrder::phi_ddot, 1, constraint_dirs_.phi_ddot, load_dirs_);
  for (std::size_t i = 0; i < rhs_lanes_.size(); ++i) rhs_lanes_[i] -= load_dirs_[i + 1];
}

void PlanarDynamics::acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir,
                                          Eigen::Ref<LaneRows> a_dir) {
  if (!tangents_ready_) prepare_tangents();
  const StateLayout layout{data_.n};
  const LaneRow* y = entries(y_dir);
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const PlanarBody& body = model_.bodies[k];
    const LaneRow* p = y + layout.p(k);
    LaneRow* P = entries(turn_dirs_[k]);
    for (int i = 0; i < 4; i += 2, p += layout.positions()) {
      P[i] = body.p_a(0) * p[0] + body.p_a(1) * p[1] + body.p_a(2) * p[2] + body.p_a(3) * p[3];
      P[i + 1] = body.p_b(0) * p[0] + body.p_b(1) * p[1] + body.p_b(2) * p[2] + body.p_b(3) * p[3];
    }
    const TurnTangent& x = turns_[k];
    LaneRow* Addot = entries(Addot_dirs_[k]);
    for (int i = 0; i < 2; ++i) {
      Addot[i] = x.Addot(i, 0) * P[0] + x.Addot(i, 1) * P[1] + x.Addot(i, 2) * P[2] + x.Addot(i, 3) * P[3];
    }
    LaneRow* b = entries(rhs_lanes_[k - 1]);
    b[0] = LaneRow{};
    b[1] = LaneRow{};
    b[2] = x.moment.re * P[1] - x.moment.im * P[0];
  }
  gamma_dir_.setZero();
  if (!dual_bodies_.empty() || !data_.laws.empty()) add_other_tangents(block, y_dir);
  constraints_.subtract_point_tangents(frames_, Addot_dirs_, block, lambda_, gamma_dir_, rhs_lanes_);

  Lanes<3> gravity_dir;
  const Lanes<3>* dg = block.field<3>(data_.slot_gravity, gravity_dir);
  for (std::size_t i = 0; dg && i < rhs_lanes_.size(); ++i) {
    const double mass = model_.bodies[i + 1].mass;
    rhs_lanes_[i].row(0) += mass * dg->row(model_.t1);
    rhs_lanes_[i].row(1) += mass * dg->row(model_.t2);
  }
  for (const std::size_t k : bodies_with_slots_) {
    InPlane::subtract_mass_tangent(data_, k, block, z_against_gravity(k), rhs_lanes_[k - 1]);
  }
  if (!loaded_.empty()) add_force_tangent(block, y_dir);
  solver_.solve(rhs_lanes_, gamma_dir_, settings_.derivatives, z_dir_, lambda_dir_);

  LaneRow* out = reinterpret_cast<LaneRow*>(a_dir.data());
  for (std::size_t k = 1; k < bodies_.size(); ++k, out += 7) {
    const PlanarBody& body = model_.bodies[k];
    const TurnTangent& x = turns_[k];
    const Plane& turn = bodies_[k].P;
    const LaneRow *P = entries(turn_dirs_[k]), *z = entries(z_dir_[k - 1]);
    for (int i = 0; i < 3; ++i) out[i] = LaneRow{};
    out[model_.t1] = z[0];
    out[model_.t2] = z[1];
    LaneRow Pddot[2];
    for (int i = 0; i < 2; ++i) {
      Pddot[i] = x.Pddot(i, 0) * P[0] + x.Pddot(i, 1) * P[1] + x.Pddot(i, 2) * P[2] + x.Pddot(i, 3) * P[3];
    }
    Pddot[0] -= (0.5 * turn.im) * z[2];
    Pddot[1] += (0.5 * turn.re) * z[2];
    for (int i = 0; i < 4; ++i) out[3 + i] = body.p_a(i) * Pddot[0] + body.p_b(i) * Pddot[1];
  }
}

}  // namespace mbsopt
