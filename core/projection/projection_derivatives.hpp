// The derivatives of a projection: TLM and adjoint. projection.hpp states the equations.
#pragma once

#include "core/projection/body_in_plane.hpp"
#include "core/projection/body_in_space.hpp"
#include "core/projection/projector_of.hpp"

namespace mbsopt {

template <class Body>
bool ProjectorOf<Body>::linearise(double t, const Y& angles, const Y& y_hat, const Y& y, const ProjectionSolution& s) {
  angles_ = angles;
  if (square_)
    read_hat(t, y_hat);
  else if (!factor(t, y_hat))
    return false;
  Space::gather(data_, s.nu, nu_), Space::gather(data_, s.kappa, kappa_);
  for_bodies([&](Body& b, std::size_t i, auto& f) {
    delta_[i] = s.delta[i].template head<N>();
    u_[i] = s.u[i].template head<N>();
    b.displace(delta_[i], f);
    b.restore_velocity(y, u_[i], f);
  });
  if (square_) return factor_square();
  rows_.evaluate(frames_);
  return true;
}

template <>
inline void ProjectorOf<BodyInSpace>::set_tangents(ProjectionLevel, const Frames& frames, const ParameterBlock& block,
                                                   const Y& lambda) {
  for (Lanes<6>& load : load_dirs_) load.setZero();
  constraints_.tangents(frames, &frame_dirs_, laws_, angles_, block, lambda, dirs_, load_dirs_);
}
template <>
inline void ProjectorOf<BodyInPlane>::set_tangents(ProjectionLevel level, const Frames&, const ParameterBlock& block,
                                                   const Y& lambda) {
  using Order = PlanarConstraints::Order;
  for (Lanes<3>& load : load_dirs_) load.setZero();
  constraints_.tangents(level == ProjectionLevel::position ? Order::phi : Order::phi_dot, frame_dirs_, laws_, angles_,
                        block, lambda, dirs_, load_dirs_);
}

template <>
inline void ProjectorOf<BodyInSpace>::set_field_tangents(const ParameterBlock& block) {
  mu_.setZero();
  constraints_.tangents(frames_, nullptr, laws_, angles_, block, mu_, dirs_, load_dirs_);
}
template <>
inline void ProjectorOf<BodyInPlane>::set_field_tangents(const ParameterBlock& block) {
  constraints_.field_tangents(frames_, laws_, angles_, block, dirs_.phi);
}

template <class Body>
void ProjectorOf<Body>::set_loads(const ParameterBlock& block, const std::vector<X>& x) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    b_lanes_[i] = -load_dirs_[i + 1];
    Space::subtract_mass_tangent(data_, i + 1, block, x[i], b_lanes_[i]);
  }
}

template <class Body>
void ProjectorOf<Body>::refine_tangent(ProjectionLevel level, const LargestEntries<Direction>& size) {
  if (square_) {  // J x = g settles x, and nu is 0
    Eigen::Map<LaneRows> x(x_lanes_[0].data(), rows_.count(), kLanes);
    x = g_lanes_;
    J_factor_.solve_lanes(x);
    return;
  }
  const auto turn = [&](std::vector<Lanes<N>>& x, bool transposed) {
    for (std::size_t i = 0; i < x.size(); ++i) bodies_[i].turn_by_E(x[i], transposed);
  };
  refine(solver_, rows_, level, false, size, b_lanes_, g_lanes_, x_lanes_, nu_lanes_, corrections_of_lanes_, turn);
}

template <class Body>
void ProjectorOf<Body>::refine_adjoint(ProjectionLevel level) {
  if (square_) {  // x = 0, J'mu = b
    mu_ = Eigen::Map<const Y>(b_[0].data(), rows_.count());
    J_factor_.solve_transposed(mu_);
    for (X& x : x_) x.setZero();
    return;
  }
  const auto turn = [&](std::vector<X>& x, bool transposed) {
    for (std::size_t i = 0; i < x.size(); ++i) bodies_[i].turn_by_E(x[i], transposed);
  };
  g_.setZero();
  refine(solver_, rows_, level, true, LargestEntries<X>::Zero(), b_, g_, x_, mu_, corrections_, turn);
}

template <class Body>
void ProjectorOf<Body>::tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir,
                                bool velocities) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].tilde_tangent(y_hat_dir, frames_tilde_[i + 1], q_dirs_[i], frame_dirs_[i + 1]);
  }
  if (positions()) {
    if (!square_) {  // else nu and delta are 0
      set_tangents(ProjectionLevel::position, frames_tilde_, block, nu_);
      set_loads(block, delta_);
    }
    for_bodies(
        [&](const Body& b, std::size_t i, const auto&) { b.position_tangent(delta_[i], q_dirs_[i], x_lanes_[i]); });
    set_field_tangents(block);
    g_lanes_ = -dirs_.phi;
    rows_.subtract_times(x_lanes_, g_lanes_);  // J x, since p' turns a unit p
    refine_tangent(ProjectionLevel::position, largest(x_lanes_));
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b.add_displacement(x_lanes_[i], q_dirs_[i]); });
  }

  if (velocities) {
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.velocity_tangent(y_hat_dir, u_[i], f, q_dirs_[i], v_dirs_[i], frame_dirs_[i + 1]);
    });
  }
  if (velocities && constrained()) {
    set_tangents(ProjectionLevel::velocity, frames_, block, kappa_);
    set_loads(block, u_);
    g_lanes_ = -dirs_.phi_dot;
    refine_tangent(ProjectionLevel::velocity, largest(v_dirs_));
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b.add_velocity_tangent(x_lanes_[i], v_dirs_[i]); });
  }
  y_dir = y_hat_dir;
  for_bodies([&](const Body& b, std::size_t i, const auto&) {
    b.write_position_tangent(q_dirs_[i], y_hat_dir, y_dir);
    if (velocities) b.write_velocity_tangent(q_dirs_[i], v_dirs_[i], y_hat_dir, y_dir);
  });
}

template <class Body>
void ProjectorOf<Body>::add_adjoint(const Y& y_bar, Y& y_hat_bar, Y& theta_bar, Y& rho_bar) {
  for_bodies([&](const Body& b, std::size_t i, const auto&) { b.start_adjoint(y_bar, q_bars_[i], v_bars_[i]); });

  // Velocities: (eta, chi) from v_bar; then the gradient of v_bar'v - eta'(M u + J'kappa) - chi'Phidot.
  for (auto& bar : bars_) bar.set_zero();
  if (constrained()) {
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b_[i] = b.u_bar(v_bars_[i]); });
    refine_adjoint(ProjectionLevel::velocity);
    for_bodies([&](const Body&, std::size_t i, auto& f) { set_virtual(x_[i], f); });
    add_pull_back(frames_, {&kappa_, nullptr, &mu_, nullptr}, theta_bar, rho_bar);
    subtract_mass_bar(u_, theta_bar);
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.pull_back_velocity(f, bars_[i + 1], q_bars_[i], v_bars_[i]);
      bars_[i + 1].set_zero();
    });
  }
  for_bodies([&](const Body& b, std::size_t i, const auto&) { b.pull_back_start(u_[i], q_bars_[i], v_bars_[i]); });

  // Positions: (eta, chi) from delta's cotangent; then the gradient of q_bar'q - eta'(M delta + J~'nu) - chi'Phi(q).
  if (constrained() && positions()) {
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b_[i] = b.delta_bar(q_bars_[i]); });
    refine_adjoint(ProjectionLevel::position);
    add_pull_back(frames_, {nullptr, &mu_, nullptr, nullptr}, theta_bar, rho_bar);
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.pull_back_position(f, bars_[i + 1], q_bars_[i]);
      bars_[i + 1].set_zero();
      set_virtual(x_[i], frames_tilde_[i + 1]);
    });
    add_pull_back(frames_tilde_, {&nu_, nullptr, nullptr, nullptr}, theta_bar, rho_bar);
    subtract_mass_bar(delta_, theta_bar);
  }
  for_bodies([&](const Body& b, std::size_t i, const auto&) {
    b.finish_adjoint(delta_[i], frames_tilde_[i + 1], bars_[i + 1], y_bar, q_bars_[i], v_bars_[i], y_hat_bar);
  });
}

}  // namespace mbsopt
