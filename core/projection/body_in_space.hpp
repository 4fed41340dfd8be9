// A body in space for the projection (projection.hpp), with the derivatives of each step:
//
//   p~ = p^/|p^|,   pi = p~ + 1/2 G(p~)' delta_theta,   p = pi/|pi|
//   pdot = pdot_n + 1/2 G(p)' u_theta,   pdot_n = pdot^ - p (p'pdot^)/(p'p)
//
// If only velocities are projected, p = p~ = p^. All functions are inline: they run once per body and iteration.
#pragma once

#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/dynamics/space.hpp"

namespace mbsopt {

class BodyInSpace {
 public:
  using Space = InSpace;
  using Direction = Lanes<7>;  // of (r, p), or of their rates
  using Gradient = Vec<7>;

  BodyInSpace(const MechanismData& data, int body, bool positions)
      : q_(StateLayout{data.n}.q(body)), v_(StateLayout{data.n}.v(body)), positions_(positions) {}

  void read_hat(const Eigen::VectorXd& y_hat, Frame& tilde) {
    const Vector4d p_hat = y_hat.segment<4>(q_ + 3);
    r_hat_ = y_hat.segment<3>(q_);
    v_hat_ = y_hat.segment<7>(v_);
    norm_hat_ = positions_ ? p_hat.norm() : 1.0;
    Vec<7> q;
    q << r_hat_, p_hat / norm_hat_;
    set_position(q, tilde);
    tilde_ = tilde;
  }
  void displace(const Vec<6>& delta, Frame& f) {
    const Vector4d pi = tilde_.p + 0.5 * G_transposed_times(tilde_.p, delta.tail<3>());
    norm_pi_ = positions_ ? pi.norm() : 1.0;
    Vec<7> q;
    q << r_hat_ + delta.head<3>(), pi / norm_pi_;
    set_position(q, f);
    state_ = f;
  }
  // Sets the velocities for u = 0, and changes u by du.
  void start_velocity(Frame& f) {
    const Vector4d pdot_hat = v_hat_.tail<4>(), &p = state_.p;
    Vec<7> v;
    v << v_hat_.head<3>(), pdot_hat - p * (p.dot(pdot_hat) / p.squaredNorm());
    set_velocity(v, f);
    state_ = f;
  }
  void add_velocity(const Vec<6>&, const Vec<6>& du, Frame& f) {
    Vec<7> v;
    v << f.rdot + du.head<3>(), state_.pdot + 0.5 * G_transposed_times(state_.p, du.tail<3>());
    set_velocity(v, f);
    state_ = f;
  }
  void write(const Frame& f, Eigen::VectorXd& y) const {
    y.segment<7>(q_) << f.r, state_.p;
    y.segment<7>(v_) << f.rdot, state_.pdot;
  }

  void read_position(const Eigen::VectorXd& y, Frame& f) {
    set_position(y.segment<7>(q_), f);
    state_ = f;
  }
  void read_velocity(const Eigen::VectorXd& y, Frame& f) {
    set_velocity(y.segment<7>(v_), f);
    state_ = f;
  }
  double norm_violation() const { return std::abs(UnitNorm::phi(state_.p)); }
  double norm_rate_violation() const { return std::abs(UnitNorm::phi_dot(state_.p, state_.pdot)); }

  // Restores the velocities of an earlier projection, after displace().
  void restore_velocity(const Eigen::VectorXd& y, const Vec<6>&, Frame& f) {
    read_velocity(y, f);
    // E = G(p) (I - p p') G(p~)'/|pi| and G(p) p = 0
    for (int k = 0; k < 3; ++k) {
      E_.col(k) = G_times(state_.p, G_transposed_times(tilde_.p, Vector3d::Unit(k))) / norm_pi_;
    }
  }
  // Turns delta' into the virtual displacement at q. X is one vector or lanes of them.
  template <class X>
  void turn_by_E(X& x, bool transposed) const {
    const auto turn = x.template bottomRows<3>().eval();
    x.template bottomRows<3>().noalias() = transposed ? (E_.transpose() * turn).eval() : (E_ * turn).eval();
  }

  // Sets the tangents of q~ and of its frame.
  void tilde_tangent(const LaneRows& y_hat_dir, const Frame&, Direction& q_dir, FrameTangent& tilde_dir) const {
    q_dir = y_hat_dir.middleRows<7>(q_);
    if (!positions_) return;
    const Lanes<4> p_hat_dir = q_dir.bottomRows<4>();
    q_dir.bottomRows<4>() = normalised(tilde_.p, norm_hat_, p_hat_dir);
    set_tangent(tilde_, q_dir, Lanes<7>::Zero(), tilde_dir);
  }
  // Sets q' with delta fixed, also as a virtual displacement.
  void position_tangent(const Vec<6>& delta, Direction& q_dir, Lanes<6>& x) const {
    const Lanes<4> p_tilde_dir = q_dir.bottomRows<4>();
    const Lanes<4> pi_dir = p_tilde_dir + 0.5 * G_transposed_lanes_times(p_tilde_dir, delta.tail<3>());
    const Lanes<4> p_dir = normalised(state_.p, norm_pi_, pi_dir);
    q_dir.bottomRows<4>() = p_dir;
    x.topRows<3>() = q_dir.topRows<3>();
    x.bottomRows<3>().noalias() = (2 * G(state_.p)) * p_dir;
  }
  // Adds the part of delta' to q'.
  void add_displacement(const Lanes<6>& delta_dir, Direction& q_dir) const {
    q_dir.topRows<3>() += delta_dir.topRows<3>();
    const Lanes<4> pi_dir = 0.5 * G_transposed_times_lanes(tilde_.p, delta_dir.bottomRows<3>());
    q_dir.bottomRows<4>() += normalised(state_.p, norm_pi_, pi_dir);
  }
  // Sets v' with u fixed, and the tangent of the frame.
  void velocity_tangent(const LaneRows& y_hat_dir, const Vec<6>& u, const Frame&, const Direction& q_dir,
                        Direction& v_dir, FrameTangent& f_dir) const {
    const Vector4d& p = state_.p;
    const Vector4d pdot_hat = v_hat_.tail<4>();
    const Lanes<4> p_dir = q_dir.bottomRows<4>();
    const Lanes<7> v_hat_dir = y_hat_dir.middleRows<7>(v_);
    v_dir = v_hat_dir;
    const double pp = p.squaredNorm(), along = p.dot(pdot_hat) / pp;
    const Lanes<1> along_dir = (pdot_hat.transpose() * p_dir + p.transpose() * v_hat_dir.bottomRows<4>() -
                                2 * along * (p.transpose() * p_dir)) /
                               pp;
    v_dir.bottomRows<4>() -= along * p_dir;
    v_dir.bottomRows<4>().noalias() -= p * along_dir;
    v_dir.bottomRows<4>() += 0.5 * G_transposed_lanes_times(p_dir, u.tail<3>());
    set_tangent(state_, q_dir, v_dir, f_dir);
  }
  // Adds the part of u' to v'.
  void add_velocity_tangent(const Lanes<6>& u_dir, Direction& v_dir) const {
    v_dir.topRows<3>() += u_dir.topRows<3>();
    v_dir.bottomRows<4>() += 0.5 * G_transposed_times_lanes(state_.p, u_dir.bottomRows<3>());
  }
  void write_position_tangent(const Direction& q_dir, const LaneRows&, LaneRows& y_dir) const {
    y_dir.middleRows<7>(q_) = q_dir;
  }
  void write_velocity_tangent(const Direction&, const Direction& v_dir, const LaneRows&, LaneRows& y_dir) const {
    y_dir.middleRows<7>(v_) = v_dir;
  }

  // The adjoint goes in reverse order: from gradients in q and v to the cotangents of u and delta.
  void start_adjoint(const Eigen::VectorXd& y_bar, Gradient& q_bar, Gradient& v_bar) const {
    q_bar = y_bar.segment<7>(q_);
    v_bar = y_bar.segment<7>(v_);
  }
  Vec<6> u_bar(const Gradient& v_bar) const {
    Vec<6> x;
    x << v_bar.head<3>(), 0.5 * G_times(state_.p, v_bar.tail<4>());
    return x;
  }
  Vec<6> delta_bar(const Gradient& q_bar) const {
    Vec<6> x;
    x << q_bar.head<3>(), 0.5 * G_times(tilde_.p, pi_bar(q_bar));
    return x;
  }
  void pull_back_velocity(const Frame& f, FrameBar& bar, Gradient& q_bar, Gradient& v_bar) const {
    fold_virtual(f.theta_eta, bar);
    add_pull_back_velocity(state_, bar, 1, q_bar, v_bar);
  }
  void pull_back_position(const Frame&, const FrameBar& bar, Gradient& q_bar) const {
    q_bar += mbsopt::pull_back_position(state_, bar);
  }
  // Pulls the gradient back through v_n and T(p) u.
  void pull_back_start(const Vec<6>& u, Gradient& q_bar, Gradient& v_bar) const {
    const Vector4d &p = state_.p, pdot_hat = v_hat_.tail<4>(), pdot_bar = v_bar.tail<4>();
    const double pp = p.squaredNorm(), along = p.dot(pdot_hat) / pp, across = p.dot(pdot_bar);
    q_bar.tail<4>() += 0.5 * G_transposed_times_adjoint(u.tail<3>(), pdot_bar);
    q_bar.tail<4>() -= along * pdot_bar + (across / pp) * (pdot_hat - 2 * along * p);
    v_bar.tail<4>() = pdot_bar - p * (across / pp);
  }
  // Adds to y_hat_bar. tilde and bar belong to q~; bar is zero if nothing is constrained.
  void finish_adjoint(const Vec<6>& delta, const Frame& tilde, FrameBar& bar, const Eigen::VectorXd&,
                      const Gradient& q_bar, const Gradient& v_bar, Eigen::VectorXd& y_hat_bar) const {
    y_hat_bar.segment<7>(v_) += v_bar;
    if (!positions_) {
      y_hat_bar.segment<7>(q_) += q_bar;
      return;
    }
    fold_virtual(tilde.theta_eta, bar);
    const Vec<7> q_tilde_bar = mbsopt::pull_back_position(tilde_, bar);  // J~ of a distance or dot-2: of r too
    const Vector4d through_pi = pi_bar(q_bar);
    Vector4d p_tilde_bar = through_pi + 0.5 * G_transposed_times_adjoint(delta.tail<3>(), through_pi);
    p_tilde_bar += q_tilde_bar.tail<4>();
    y_hat_bar.segment<3>(q_) += q_bar.head<3>();
    y_hat_bar.segment<3>(q_) += q_tilde_bar.head<3>();
    y_hat_bar.segment<4>(q_ + 3) += (p_tilde_bar - tilde_.p * tilde_.p.dot(p_tilde_bar)) / norm_hat_;
  }

 private:
  // p' of p = pi/|pi|, for lanes of pi'.
  static Lanes<4> normalised(const Vector4d& p, double norm, const Lanes<4>& pi_dir) {
    Lanes<4> out = pi_dir;
    out.noalias() -= p * (p.transpose() * pi_dir);
    return out / norm;
  }
  Vector4d pi_bar(const Gradient& q_bar) const {
    const Vector4d p_bar = q_bar.tail<4>();
    return (p_bar - state_.p * state_.p.dot(p_bar)) / norm_pi_;
  }

  Eigen::Index q_, v_;  // rows of r and rdot in y
  bool positions_;
  BodyState tilde_, state_;
  Vector3d r_hat_;
  Vec<7> v_hat_;
  double norm_hat_ = 1, norm_pi_ = 1;
  Matrix3d E_;  // d(virtual rotation at p)/d(delta_theta)
};

}  // namespace mbsopt
