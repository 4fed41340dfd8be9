// A body in the plane for the projection (projection.hpp), with the derivatives of each step. A position is (r, theta),
// P = e^(i theta/2).
//
//   theta = theta~ + 2 atan(delta_theta/2)                  pi = p~ + 1/2 G(p~)' delta_theta, normalised, turns so
//   w = w_n + u_theta,   w_n = 2 Im(conj(P) Pdot^),   Pdot = i w/2 P
//
// The components of y out of the plane keep their values. All functions are inline.
#pragma once

#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/dynamics/space.hpp"

namespace mbsopt {

class BodyInPlane {
  using Frame = InPlane::Frame;
  using FrameBar = InPlane::FrameBar;
  using FrameTangent = InPlane::FrameTangent;

 public:
  using Space = InPlane;
  using Direction = Lanes<3>;  // of (r, theta), or of (rdot, w)
  struct Gradient {
    Plane r;
    double theta = 0;
  };

  BodyInPlane(const MechanismData& data, int body, bool)
      : in_y_(*data.planar), k_(at(body)), q_(StateLayout{data.n}.q(body)), v_(StateLayout{data.n}.v(body)) {}

  void read_hat(const Eigen::VectorXd& y_hat, Frame& tilde) {
    r_hat_ = in_y_.vector(y_hat, q_);
    rdot_hat_ = in_y_.vector(y_hat, v_);
    P_hat_ = in_y_.turn(k_, y_hat, q_ + 3);
    Pdot_hat_ = in_y_.turn(k_, y_hat, v_ + 3);
    P_tilde_ = (1 / std::sqrt(squared_norm(P_hat_))) * P_hat_;
    tilde.r = r_hat_;
    tilde.A = P_tilde_ * P_tilde_;
  }
  void displace(const Vec<3>& delta, Frame& f) {
    const double half = 0.5 * delta(2), norm2 = 1 + half * half;
    f.r = r_hat_ + Plane{delta(0), delta(1)};
    P_ = (1 / std::sqrt(norm2)) * (Plane{1, half} * P_tilde_);
    theta_by_delta_ = 1 / norm2;
    f.A = P_ * P_;
  }
  void start_velocity(Frame& f) {
    w_n_ = 2 * cross(P_, Pdot_hat_);
    add_velocity(Vec<3>::Zero(), {}, f);
  }
  void add_velocity(const Vec<3>& u, const Vec<3>&, Frame& f) {
    w_ = w_n_ + u(2);
    f.rdot = rdot_hat_ + Plane{u(0), u(1)};
    f.Adot = times_i(w_ * f.A);
  }
  void write(const Frame& f, Eigen::VectorXd& y) const {
    in_y_.add_vector(f.r - r_hat_, q_, y);
    in_y_.add_turn(k_, P_ - P_hat_, q_ + 3, y);
    in_y_.add_vector(f.rdot - rdot_hat_, v_, y);
    in_y_.add_turn(k_, times_i(0.5 * w_ * P_) - Pdot_hat_, v_ + 3, y);
  }

  void read_position(const Eigen::VectorXd& y, Frame& f) {
    P_ = in_y_.turn(k_, y, q_ + 3);
    f.r = in_y_.vector(y, q_);
    f.A = P_ * P_;
  }
  void read_velocity(const Eigen::VectorXd& y, Frame& f) {
    Pdot_ = in_y_.turn(k_, y, v_ + 3);
    f.rdot = in_y_.vector(y, v_);
    f.Adot = 2 * (P_ * Pdot_);
  }
  double norm_violation() const { return std::abs(squared_norm(P_) - 1); }
  double norm_rate_violation() const { return 2 * std::abs(dot(P_, Pdot_)); }

  void restore_velocity(const Eigen::VectorXd&, const Vec<3>& u, Frame& f) {
    start_velocity(f);
    add_velocity(u, {}, f);
  }
  template <class X>
  void turn_by_E(X& x, bool) const {
    x.row(2) *= theta_by_delta_;
  }

  void tilde_tangent(const LaneRows& y_hat_dir, const Frame& tilde, Direction& q_dir, FrameTangent& tilde_dir) const {
    const PlaneDual r = in_y_.vector(r_hat_, y_hat_dir, q_), P = in_y_.turn(k_, P_hat_, y_hat_dir, q_ + 3);
    q_dir.row(0) = lanes(r.re);
    q_dir.row(1) = lanes(r.im);
    q_dir.row(2) = (2 / squared_norm(P_hat_)) * (P_hat_.re * lanes(P.im) - P_hat_.im * lanes(P.re));
    set_position(tilde, q_dir, tilde_dir);
  }
  void position_tangent(const Vec<3>&, const Direction& q_dir, Lanes<3>& x) const { x = q_dir; }
  void add_displacement(Lanes<3>& delta_dir, Direction& q_dir) const {
    turn_by_E(delta_dir, false);
    q_dir += delta_dir;
  }
  // w_n' = 2 Im(conj(P) Pdot^') - theta' Re(conj(P) Pdot^)
  void velocity_tangent(const LaneRows& y_hat_dir, const Vec<3>&, const Frame& f, const Direction& q_dir,
                        Direction& v_dir, FrameTangent& f_dir) const {
    const PlaneDual rdot = in_y_.vector(rdot_hat_, y_hat_dir, v_), Pdot = in_y_.turn(k_, Pdot_hat_, y_hat_dir, v_ + 3);
    v_dir.row(0) = lanes(rdot.re);
    v_dir.row(1) = lanes(rdot.im);
    v_dir.row(2) = 2 * (P_.re * lanes(Pdot.im) - P_.im * lanes(Pdot.re)) - dot(P_, Pdot_hat_) * q_dir.row(2);
    set_position(f, q_dir, f_dir);
    f_dir.rdot = {dual(f.rdot.re, lanes(rdot.re)), dual(f.rdot.im, lanes(rdot.im))};
    f_dir.Adot = times_i(dual(w_, v_dir.row(2)) * f_dir.A);
  }
  void add_velocity_tangent(const Lanes<3>& u_dir, Direction& v_dir) const { v_dir += u_dir; }
  void write_position_tangent(const Direction& q_dir, const LaneRows& y_hat_dir, LaneRows& y_dir) const {
    replace(q_, q_dir, turned(q_dir), y_hat_dir, y_dir);
  }
  // Pdot = i w/2 P
  void write_velocity_tangent(const Direction& q_dir, const Direction& v_dir, const LaneRows& y_hat_dir,
                              LaneRows& y_dir) const {
    const PlaneDual Pdot = times_i(dual(0.5 * w_, 0.5 * v_dir.row(2)) * turned(q_dir));
    replace(v_, v_dir, Pdot, y_hat_dir, y_dir);
  }

  void start_adjoint(const Eigen::VectorXd& y_bar, Gradient& q_bar, Gradient& v_bar) const {
    const Plane iP = times_i(P_);
    const Plane P_bar = in_y_.turn(k_, y_bar, q_ + 3), Pdot_bar = in_y_.turn(k_, y_bar, v_ + 3);
    q_bar = {in_y_.vector(y_bar, q_), 0.5 * (dot(P_bar, iP) - 0.5 * w_ * dot(Pdot_bar, P_))};
    v_bar = {in_y_.vector(y_bar, v_), 0.5 * dot(Pdot_bar, iP)};
  }
  Vec<3> u_bar(const Gradient& v_bar) const { return {v_bar.r.re, v_bar.r.im, v_bar.theta}; }
  Vec<3> delta_bar(const Gradient& q_bar) const { return {q_bar.r.re, q_bar.r.im, theta_by_delta_ * q_bar.theta}; }
  void pull_back_velocity(const Frame& f, FrameBar& bar, Gradient& q_bar, Gradient& v_bar) const {
    fold_virtual(f, bar);
    q_bar.r += bar.r;
    q_bar.theta += dot(bar.A, times_i(f.A)) + dot(bar.Adot, times_i(f.Adot));
    v_bar.r += bar.rdot;
    v_bar.theta += dot(bar.Adot, times_i(f.A));
  }
  void pull_back_position(const Frame& f, const FrameBar& bar, Gradient& q_bar) const {
    q_bar.r += bar.r;
    q_bar.theta += dot(bar.A, times_i(f.A));
  }
  void pull_back_start(const Vec<3>&, Gradient& q_bar, const Gradient& v_bar) const {
    q_bar.theta -= v_bar.theta * dot(P_, Pdot_hat_);
  }
  void finish_adjoint(const Vec<3>&, const Frame& tilde, FrameBar& bar, const Eigen::VectorXd& y_bar, Gradient& q_bar,
                      const Gradient& v_bar, Eigen::VectorXd& y_hat_bar) const {
    fold_virtual(tilde, bar);
    pull_back_position(tilde, bar, q_bar);
    const auto carry = [&](Eigen::Index first, const Plane& r_bar, const Plane& turn_bar) {
      y_hat_bar.segment<7>(first) += y_bar.segment<7>(first);
      in_y_.add_vector(r_bar - in_y_.vector(y_bar, first), first, y_hat_bar);
      in_y_.add_turn(k_, turn_bar - in_y_.turn(k_, y_bar, first + 3), first + 3, y_hat_bar);
    };
    carry(q_, q_bar.r, (2 * q_bar.theta / squared_norm(P_hat_)) * times_i(P_hat_));
    carry(v_, v_bar.r, (2 * v_bar.theta) * times_i(P_));
  }

 private:
  // The frame f along the direction of (r, theta).
  static void set_position(const Frame& f, const Direction& q_dir, FrameTangent& f_dir) {
    const Plane iA = times_i(f.A);
    f_dir.r = {dual(f.r.re, q_dir.row(0)), dual(f.r.im, q_dir.row(1))};
    f_dir.A = {dual(f.A.re, iA.re * q_dir.row(2)), dual(f.A.im, iA.im * q_dir.row(2))};
  }

  // P' = i theta'/2 P
  PlaneDual turned(const Direction& q_dir) const {
    const Plane iP = times_i(P_);
    return {dual(P_.re, 0.5 * iP.re * q_dir.row(2)), dual(P_.im, 0.5 * iP.im * q_dir.row(2))};
  }
  void replace(Eigen::Index first, const Direction& dir, const PlaneDual& turn, const LaneRows& y_hat_dir,
               LaneRows& y_dir) const {
    in_y_.set_vector_direction(dir, first, y_dir);
    in_y_.add_turn_direction(k_, turn - in_y_.turn(k_, {}, y_hat_dir, first + 3), first + 3, y_dir);
  }

  PlanarBodies in_y_;
  std::size_t k_;
  Eigen::Index q_, v_;  // rows of r and rdot in y
  Plane r_hat_, rdot_hat_, P_hat_, Pdot_hat_, P_tilde_, P_, Pdot_;
  double theta_by_delta_ = 1;  // d theta/d delta_theta
  double w_n_ = 0, w_ = 0;
};

}  // namespace mbsopt
