// The projection itself, the violations of the constraints, and the response of their forces.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/projection/body_in_plane.hpp"
#include "core/projection/body_in_space.hpp"
#include "core/projection/projector_of.hpp"

namespace mbsopt {

// Blocks are faster for more unknowns than these.
inline constexpr Eigen::Index kDenseUnknowns = 48;

// Accelerations of body i (1-based) of size 1. No symmetry of a mechanism makes a direction vanish in them.
template <int N>
Vec<N> test_load(int i) {
  Vec<N> x;
  for (int k = 0; k < N; ++k) x(k) = std::cos(1.0 + 2.7 * (N * i + k) + 0.31 * i * i);
  return x;
}

template <class Body>
ProjectorOf<Body>::ProjectorOf(const Mechanism& mechanism, Projection what, Free free)
    : Projector(mechanism, what),
      square_(free == Free::nothing && Space::rows(data_) == N * data_.n && N * data_.n <= kDenseUnknowns),
      settled_(solution()),
      solver_(data_, kProjectionAlpha * rows_of<Space>(data_, data_.row_alpha)),
      rows_(data_),
      constraints_(data_),
      laws_(Space::laws(data_)),
      row_size_(rows_of<Space>(data_, data_.row_size)) {
  const std::size_t n = at(data_.n);
  const Eigen::Index m = rows_.count();
  for (int i = 1; i <= data_.n; ++i) bodies_.emplace_back(data_, i, positions());
  frames_.resize(n + 1);
  frames_tilde_.resize(n + 1);
  bars_.resize(n + 1);
  load_dirs_.resize(n + 1);
  frame_dirs_.assign(n + 1, Space::still());
  q_bars_.resize(n);
  v_bars_.resize(n);
  q_dirs_.resize(n);
  v_dirs_.resize(n);
  for (auto* x : {&delta_, &u_, &b_, &x_, &corrections_.r, &corrections_.dx, &corrections_.Ex}) x->resize(n);
  for (Y* x : {&nu_, &kappa_, &phi_, &g_, &mu_, &corrections_.rg, &corrections_.dnu}) x->setZero(m);
  angles_.setZero(static_cast<Eigen::Index>(data_.angles.size()));
  auto& lanes = corrections_of_lanes_;
  for (auto* x : {&b_lanes_, &x_lanes_, &lanes.r, &lanes.dx, &lanes.Ex}) x->resize(n);
  for (LaneRows* x : {&dirs_.phi, &dirs_.phi_dot, &dirs_.phi_ddot, &g_lanes_, &nu_lanes_, &lanes.rg, &lanes.dnu}) {
    x->setZero(m, kLanes);
  }
}

template <class Body>
void ProjectorOf<Body>::read_hat(double t, const Y& y_hat) {
  laws_.set_time(t);
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].read_hat(y_hat, frames_tilde_[i + 1]);
}
template <class Body>
bool ProjectorOf<Body>::factor(double t, const Y& y_hat) {
  read_hat(t, y_hat);
  return solver_.factor(frames_tilde_);
}

template <class Body>
bool ProjectorOf<Body>::project(double t, const Y& angles, const Y& y_hat, Y& y, ProjectionSolution& s) {
  if (!factor(t, y_hat)) return false;
  const Eigen::Index half = StateLayout{data_.n}.positions();
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  const auto displace = [&](const std::vector<X>&) {
    for_bodies([&](Body& b, std::size_t i, auto& f) { b.displace(delta_[i], f); });
  };
  for (X& d : delta_) d.setZero();
  nu_.setZero();
  displace(delta_);
  const auto phi = [&](Y& out) { constraints_.phi(frames_, laws_, angles, out); };
  if (positions() &&
      !onto_constraints(solver_, solver_.rows(), q_size, kUnmetPosition, delta_, nu_, corrections_, phi, displace))
    return false;

  for_bodies([](Body& b, std::size_t, auto& f) { b.start_velocity(f); });
  rows_.evaluate(frames_);
  const auto phi_dot = [&](Y& out) { constraints_.phi_dot(frames_, laws_, out); };
  const auto add_velocity = [&](const std::vector<X>& du) {
    for_bodies([&](Body& b, std::size_t i, auto& f) { b.add_velocity(u_[i], du[i], f); });
  };
  if (!onto_constraints(solver_, rows_, v_size, kUnmetVelocity, u_, kappa_, corrections_, phi_dot, add_velocity))
    return false;

  y = y_hat;
  for_bodies([&](Body& b, std::size_t i, auto& f) {
    b.write(f, y);
    s.delta[i].template head<N>() = delta_[i];
    s.u[i].template head<N>() = u_[i];
  });
  Space::spread(data_, nu_, s.nu), Space::spread(data_, kappa_, s.kappa);
  return y.allFinite();
}

// Uses the load of the plane for planar mechanisms, so that both models take the same steps.
template <>
inline Vec<6> ProjectorOf<BodyInSpace>::test_load_of(int body) const {
  return data_.planar ? PlanarBodies(*data_.planar).in_space(at(body), test_load<3>(body)) : test_load<6>(body);
}
template <>
inline Vec<3> ProjectorOf<BodyInPlane>::test_load_of(int body) const {
  return test_load<3>(body);
}

template <class Body>
void ProjectorOf<Body>::response(Y& out) {
  if (square_) return response_of_square(out);
  for (std::size_t i = 0; i < b_.size(); ++i) {
    const int body = static_cast<int>(i) + 1;
    b_[i] = solver_.mass_times(body, test_load_of(body));
  }
  g_.setZero();
  solver_.solve(b_, g_, Refinements{}, corrections_.dx, corrections_.dnu);
  g_ = kProjectionAlpha * corrections_.dnu.cwiseQuotient(solver_.alpha());
  for (X& b : b_) b.setZero();
  solver_.solve(b_, g_, Refinements{}, corrections_.dx, corrections_.dnu);
  out = kProjectionAlpha * corrections_.dnu.cwiseQuotient(solver_.alpha());
}

template <class Body>
double ProjectorOf<Body>::position_violation(double t, const Y& angles, const Y& y, double* relative) {
  laws_.set_time(t);
  for_bodies([&](Body& b, std::size_t, auto& f) { b.read_position(y, f); });
  constraints_.phi(frames_, laws_, angles, phi_);
  double of_norms = 0;
  for (const Body& b : bodies_) of_norms = std::max(of_norms, b.norm_violation());
  if (relative)
    *relative = constrained() ? std::max(phi_.cwiseQuotient(row_size_).cwiseAbs().maxCoeff(), of_norms) : of_norms;
  return constrained() ? std::max(phi_.cwiseAbs().maxCoeff(), of_norms) : of_norms;
}

template <class Body>
double ProjectorOf<Body>::velocity_violation(double t, const Y& y) {
  laws_.set_time(t);
  for_bodies([&](Body& b, std::size_t, auto& f) { b.read_position(y, f), b.read_velocity(y, f); });
  constraints_.phi_dot(frames_, laws_, phi_);
  double worst = constrained() ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (const Body& b : bodies_) worst = std::max(worst, b.norm_rate_violation());
  return worst;
}

}  // namespace mbsopt
