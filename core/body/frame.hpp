// What constraints, forces and sensors see of a body: its centre of mass r and the matrix A of its axes, with their
// first and second time derivatives. Every primitive is a polynomial in these, so its derivatives in (q, v) are taken
// in two steps: to the frame here, from the frame to (r, p) and (rdot, pdot) by the pull-backs below, once per body.
//
//   A = A(p)     Adot = B(p, pdot)     Addot = B(p, pddot) + 2 A(pdot)
//   pddot = 1/2 G(p)' omegadot - (pdot'pdot) p       (the unit-norm equation differentiated twice, solved by hand)
//
// A virtual displacement (eta_r, eta_theta), eta_theta in body axes, moves a body-fixed vector s by A skew(eta_theta)
// s and the Euler parameters, which a frame carries along for drives of single coordinates, by 1/2 G(p)' eta_theta.
#pragma once

#include "core/body/euler_parameters.hpp"

namespace mbsopt {

struct Frame {
  Vector3d r = Vector3d::Zero(), rdot = Vector3d::Zero(), rddot = Vector3d::Zero();
  Matrix3d A = Matrix3d::Identity(), Adot = Matrix3d::Zero(), Addot = Matrix3d::Zero();
  // Virtual displacement of the adjoint sweep, as the primitives see it: A skew(eta_theta).
  Vector3d r_eta = Vector3d::Zero(), theta_eta = Vector3d::Zero();
  Matrix3d A_eta = Matrix3d::Zero();
  Vector4d p{1, 0, 0, 0}, pdot = Vector4d::Zero(), pddot = Vector4d::Zero(), p_eta = Vector4d::Zero();

  Vector3d point(const Vector3d& s) const { return r + A * s; }
  Vector3d point_dot(const Vector3d& s) const { return rdot + Adot * s; }
  Vector3d point_ddot(const Vector3d& s) const { return rddot + Addot * s; }
  Vector3d point_eta(const Vector3d& s) const { return r_eta + A_eta * s; }
};

// Gradient of a scalar with respect to the entries of a Frame.
struct FrameBar {
  Vector3d r, rdot;
  Matrix3d A, Adot, Addot, A_eta;
  Vector4d p, pdot, pddot, p_eta;
  void set_zero() {
    r.setZero(), rdot.setZero();
    A.setZero(), Adot.setZero(), Addot.setZero(), A_eta.setZero();
    p.setZero(), pdot.setZero(), pddot.setZero(), p_eta.setZero();
  }
};

// Tangent of a Frame in kLanes directions: matrices entry by entry (row 3 i + j: entry (i, j)).
struct FrameTangent {
  Lanes<3> r, rdot;
  Lanes<9> A, Adot, Addot;
  Lanes<4> p, pdot, pddot;
  void set_zero() {
    r.setZero(), rdot.setZero();
    A.setZero(), Adot.setZero(), Addot.setZero();
    p.setZero(), pdot.setZero(), pddot.setZero();
  }
};

// A body's own numbers at a state: q = (r, p), v = (rdot, pdot), z = (rddot, omegadot in body axes).
struct BodyState {
  Vector4d p{1, 0, 0, 0}, pdot = Vector4d::Zero();
  Vector3d omegadot = Vector3d::Zero();

  Vector3d omega() const { return omega_B(p, pdot); }
  Vector4d pddot() const { return 0.5 * G_transposed_times(p, omegadot) - pdot.squaredNorm() * p; }
};

inline void set_position(const Vec<7>& q, BodyState& body, Frame& frame) {
  body.p = q.tail<4>();
  frame.r = q.head<3>();
  frame.A = A(body.p);
  frame.p = body.p;
}
inline void set_velocity(const Vec<7>& v, BodyState& body, Frame& frame) {
  body.pdot = v.tail<4>();
  frame.rdot = v.head<3>();
  frame.Adot = B(body.p, body.pdot);
  frame.pdot = body.pdot;
}
inline void set_acceleration(const Vec<6>& z, BodyState& body, Frame& frame) {
  body.omegadot = z.tail<3>();
  frame.rddot = z.head<3>();
  frame.Addot = frame.A * skew(body.omegadot) + 2 * A(body.pdot) - 2 * body.pdot.squaredNorm() * frame.A;
  frame.pddot = body.pddot();
}
inline void set_virtual(const Vec<6>& eta, Frame& frame) {
  frame.r_eta = eta.head<3>();
  frame.theta_eta = eta.tail<3>();
  frame.A_eta = frame.A * skew(frame.theta_eta);
  frame.p_eta = 0.5 * G_transposed_times(frame.p, frame.theta_eta);
}

// a = qddot from z: (rddot, pddot).
inline Vec<7> acceleration(const BodyState& body, const Frame& frame) {
  Vec<7> a;
  a << frame.rddot, body.pddot();
  return a;
}

// T(p)' w: a cotangent of (rddot, pddot) seen by z = (rddot, omegadot).
inline Vec<6> to_virtual(const BodyState& body, const Vec<7>& w) {
  Vec<6> x;
  x.head<3>() = w.head<3>();
  x.tail<3>() = 0.5 * G_times(body.p, w.tail<4>());
  return x;
}

// The cotangents of the virtual displacements' images A_eta and p_eta moved to A and p, eta_theta held fixed.
inline void fold_virtual(const Vector3d& eta_theta, FrameBar& bar) {
  bar.A.noalias() -= bar.A_eta * skew(eta_theta);
  bar.p += 0.5 * G_transposed_times_adjoint(eta_theta, bar.p_eta);
}

// Pull-back of a gradient in (r, A, p) to q. [7]
inline Vec<7> pull_back_position(const BodyState& body, const FrameBar& bar) {
  Vec<7> q_bar;
  q_bar.head<3>() = bar.r;
  q_bar.tail<4>() = bar.p;
  q_bar.tail<4>().noalias() += K(bar.A) * body.p;
  return q_bar;
}

// Pull-back of a gradient in (r, rdot, A, Adot, p, pdot) to q and v.
inline void add_pull_back_velocity(const BodyState& body, const FrameBar& bar, double scale, Eigen::Ref<Vec<7>> q_bar,
                                   Eigen::Ref<Vec<7>> v_bar) {
  const Mat<4, 4> K_dot = K(bar.Adot);
  q_bar.head<3>() += scale * bar.r;
  q_bar.tail<4>() += scale * (bar.p + K(bar.A) * body.p + K_dot * body.pdot);
  v_bar.head<3>() += scale * bar.rdot;
  v_bar.tail<4>() += scale * (bar.pdot + K_dot * body.p);
}

// Full pull-back of the adjoint sweep: bar, and w_p, the cotangent of pddot itself; eta_theta: the virtual rotation.
// z is held fixed: its own cotangent is what the adjoint system solves for.
inline void add_pull_back(const BodyState& body, FrameBar bar, const Vector4d& w_p, const Vector3d& eta_theta,
                          Eigen::Ref<Vec<7>> q_bar, Eigen::Ref<Vec<7>> v_bar) {
  fold_virtual(eta_theta, bar);
  const Mat<4, 4> K_dot = K(bar.Adot), K_ddot = K(bar.Addot);
  const Vector4d pddot_bar = K_ddot * body.p + w_p + bar.pddot;
  q_bar.head<3>() += bar.r;
  q_bar.tail<4>() += bar.p + K(bar.A) * body.p + K_dot * body.pdot + K_ddot * body.pddot() +
                     0.5 * G_transposed_times_adjoint(body.omegadot, pddot_bar) - body.pdot.squaredNorm() * pddot_bar;
  v_bar.head<3>() += bar.rdot;
  v_bar.tail<4>() += bar.pdot + K_dot * body.p + 2 * (K_ddot * body.pdot) - 2 * body.p.dot(pddot_bar) * body.pdot;
}

// Tangent of the frame for directions (q', v') with z held fixed.
void set_tangent(const BodyState& body, const Lanes<7>& q_dir, const Lanes<7>& v_dir, FrameTangent& out);

// Lanes of a matrix-vector product M' s, M' given entry by entry.
inline Lanes<3> times(const Lanes<9>& M, const Vector3d& s) {
  Lanes<3> x;
  for (int i = 0; i < 3; ++i) x.row(i) = M.row(3 * i) * s(0) + M.row(3 * i + 1) * s(1) + M.row(3 * i + 2) * s(2);
  return x;
}
inline Lanes<3> transposed_times(const Lanes<9>& M, const Vector3d& z) {
  Lanes<3> x;
  for (int j = 0; j < 3; ++j) x.row(j) = M.row(j) * z(0) + M.row(3 + j) * z(1) + M.row(6 + j) * z(2);
  return x;
}
inline Lanes<1> dot(const Vector3d& a, const Lanes<3>& b) {
  return a(0) * b.row(0) + a(1) * b.row(1) + a(2) * b.row(2);
}
inline Lanes<3> cross(const Vector3d& a, const Lanes<3>& b) {
  Lanes<3> x;
  x.row(0) = a(1) * b.row(2) - a(2) * b.row(1);
  x.row(1) = a(2) * b.row(0) - a(0) * b.row(2);
  x.row(2) = a(0) * b.row(1) - a(1) * b.row(0);
  return x;
}

}  // namespace mbsopt
