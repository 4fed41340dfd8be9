#include "core/body/frame.hpp"

#include "core/body/euler_parameters.hpp"

namespace mbsopt {
namespace {

// B(p, w') entry by entry for each direction w'.
void set_B(const Vector4d& p, const Lanes<4>& w, double scale, Lanes<9>& out) {
  const double e0 = 2 * scale * p(0), e1 = 2 * scale * p(1), e2 = 2 * scale * p(2), e3 = 2 * scale * p(3);
  const auto w0 = w.row(0), w1 = w.row(1), w2 = w.row(2), w3 = w.row(3);
  out.row(0) = e0 * w0 + e1 * w1 - e2 * w2 - e3 * w3;
  out.row(4) = e0 * w0 - e1 * w1 + e2 * w2 - e3 * w3;
  out.row(8) = e0 * w0 - e1 * w1 - e2 * w2 + e3 * w3;
  out.row(1) = e1 * w2 + e2 * w1 - e0 * w3 - e3 * w0;
  out.row(3) = e1 * w2 + e2 * w1 + e0 * w3 + e3 * w0;
  out.row(2) = e1 * w3 + e3 * w1 + e0 * w2 + e2 * w0;
  out.row(6) = e1 * w3 + e3 * w1 - e0 * w2 - e2 * w0;
  out.row(5) = e2 * w3 + e3 * w2 - e0 * w1 - e1 * w0;
  out.row(7) = e2 * w3 + e3 * w2 + e0 * w1 + e1 * w0;
}

}  // namespace

void set_tangent(const BodyState& body, const Lanes<7>& q_dir, const Lanes<7>& v_dir, FrameTangent& out) {
  const Lanes<4> p_dir = q_dir.bottomRows<4>(), pdot_dir = v_dir.bottomRows<4>();
  out.r = q_dir.topRows<3>();
  out.rdot = v_dir.topRows<3>();
  set_B(body.p, p_dir, 1, out.A);
  Lanes<9> other;
  set_B(body.p, pdot_dir, 1, out.Adot);
  set_B(body.pdot, p_dir, 1, other);
  out.Adot += other;
  const Lanes<4> pddot_dir = pddot_tangent(body, p_dir, pdot_dir);
  // Addot' = B(p, pddot') + B(p', pddot) + 2 B(pdot, pdot')
  set_B(body.p, pddot_dir, 1, out.Addot);
  set_B(pddot_of(body), p_dir, 1, other);
  out.Addot += other;
  set_B(body.pdot, pdot_dir, 2, other);
  out.Addot += other;
  out.p = p_dir;
  out.pdot = pdot_dir;
  out.pddot = pddot_dir;
  out.still = false;
}

// pddot' = 1/2 G(p')' omegadot - 2 (pdot'pdot') p - (pdot'pdot) p'
Lanes<4> pddot_tangent(const BodyState& body, const Lanes<4>& p_dir, const Lanes<4>& pdot_dir) {
  const Vector3d& w = body.omegadot;
  Lanes<4> x;
  x.row(0) = -0.5 * (w(0) * p_dir.row(1) + w(1) * p_dir.row(2) + w(2) * p_dir.row(3));
  x.row(1) = 0.5 * (w(0) * p_dir.row(0) + w(2) * p_dir.row(2) - w(1) * p_dir.row(3));
  x.row(2) = 0.5 * (w(1) * p_dir.row(0) + w(0) * p_dir.row(3) - w(2) * p_dir.row(1));
  x.row(3) = 0.5 * (w(2) * p_dir.row(0) + w(1) * p_dir.row(1) - w(0) * p_dir.row(2));
  const Lanes<1> spin = 2 * (body.pdot(0) * pdot_dir.row(0) + body.pdot(1) * pdot_dir.row(1) +
                             body.pdot(2) * pdot_dir.row(2) + body.pdot(3) * pdot_dir.row(3));
  for (int i = 0; i < 4; ++i) x.row(i) -= body.p(i) * spin + body.pdot.squaredNorm() * p_dir.row(i);
  return x;
}

void set_unit_tangents(const BodyState& body, UnitTangents& out) {
  Lanes<7> e = Lanes<7>::Zero();
  const Lanes<7> none = Lanes<7>::Zero();
  e.topLeftCorner<3, 3>().setIdentity();
  set_tangent(body, e, none, out.r);
  set_tangent(body, none, e, out.rdot);
  e.setZero();
  e.bottomRows<4>().setIdentity();
  set_tangent(body, e, none, out.p);
  set_tangent(body, none, e, out.pdot);
}

void FrameBar::set_zero() {
  r.setZero();
  rdot.setZero();
  A.setZero();
  Adot.setZero();
  Addot.setZero();
  A_eta.setZero();
  p.setZero();
  pdot.setZero();
  pddot.setZero();
  p_eta.setZero();
}

void FrameTangent::set_zero() {
  r.setZero();
  rdot.setZero();
  A.setZero();
  Adot.setZero();
  Addot.setZero();
  p.setZero();
  pdot.setZero();
  pddot.setZero();
  still = true;
}

Vector3d BodyState::omega() const { return omega_B(p, pdot); }

// G(p)' omegadot/2 - (pdot'pdot) p, entry by entry: the processor would wait for a product that is kept in memory.
Vector4d pddot_of(const BodyState& body) {
  const Vector4d& p = body.p;
  const double x = 0.5 * body.omegadot(0), y = 0.5 * body.omegadot(1), z = 0.5 * body.omegadot(2);
  const double s = body.pdot.squaredNorm(), e0 = p(0), e1 = p(1), e2 = p(2), e3 = p(3);
  return {-e1 * x - e2 * y - e3 * z - s * e0, e0 * x - e3 * y + e2 * z - s * e1, e3 * x + e0 * y - e1 * z - s * e2,
          -e2 * x + e1 * y + e0 * z - s * e3};
}

void set_position(const Eigen::Ref<const Vec<7>>& q, Frame& frame) {
  frame.r = q.head<3>();
  frame.p = q.tail<4>();
  frame.A = A(frame.p);
}

void set_velocity(const Eigen::Ref<const Vec<7>>& v, Frame& frame) {
  frame.rdot = v.head<3>();
  frame.pdot = v.tail<4>();
  frame.Adot = B(frame.p, frame.pdot);
}

void set_acceleration(const Vec<6>& z, Frame& frame) {
  frame.rddot = z.head<3>();
  frame.omegadot = z.tail<3>();
  frame.Addot = 2 * A(frame.pdot) - 2 * frame.pdot.squaredNorm() * frame.A;
  if ((frame.omegadot.array() != 0).any()) frame.Addot += frame.A * skew(frame.omegadot);
  frame.pddot = pddot_of(frame);
}

void set_virtual(const Vec<6>& eta, Frame& frame) {
  frame.r_eta = eta.head<3>();
  frame.theta_eta = eta.tail<3>();
  frame.A_eta = frame.A * skew(frame.theta_eta);
  frame.p_eta = 0.5 * G_transposed_times(frame.p, frame.theta_eta);
}

Vec<6> to_virtual(const BodyState& body, const Vec<7>& w) {
  Vec<6> x;
  x.head<3>() = w.head<3>();
  x.tail<3>() = 0.5 * G_times(body.p, w.tail<4>());
  return x;
}

void fold_virtual(const Vector3d& eta_theta, FrameBar& bar) {
  bar.A.noalias() -= bar.A_eta * skew(eta_theta);
  bar.p += 0.5 * G_transposed_times_adjoint(eta_theta, bar.p_eta);
}

Vec<7> pull_back_position(const BodyState& body, const FrameBar& bar) {
  Vec<7> q_bar;
  q_bar.head<3>() = bar.r;
  q_bar.tail<4>() = bar.p;
  q_bar.tail<4>().noalias() += K(bar.A) * body.p;
  return q_bar;
}

void add_pull_back_velocity(const BodyState& body, const FrameBar& bar, double scale, Eigen::Ref<Vec<7>> q_bar,
                            Eigen::Ref<Vec<7>> v_bar) {
  const Mat<4, 4> K_dot = K(bar.Adot);
  q_bar.head<3>() += scale * bar.r;
  q_bar.tail<4>() += scale * (bar.p + K(bar.A) * body.p + K_dot * body.pdot);
  v_bar.head<3>() += scale * bar.rdot;
  v_bar.tail<4>() += scale * (bar.pdot + K_dot * body.p);
}

void add_pull_back(const BodyState& body, FrameBar bar, const Vector4d& w_p, const Vector3d& eta_theta,
                   Eigen::Ref<Vec<7>> q_bar, Eigen::Ref<Vec<7>> v_bar) {
  fold_virtual(eta_theta, bar);
  const Mat<4, 4> K_dot = K(bar.Adot), K_ddot = K(bar.Addot);
  const Vector4d pddot_bar = K_ddot * body.p + w_p + bar.pddot;
  q_bar.head<3>() += bar.r;
  q_bar.tail<4>() += bar.p + K(bar.A) * body.p + K_dot * body.pdot + K_ddot * pddot_of(body) +
                     0.5 * G_transposed_times_adjoint(body.omegadot, pddot_bar) - body.pdot.squaredNorm() * pddot_bar;
  v_bar.head<3>() += bar.rdot;
  v_bar.tail<4>() += bar.pdot + K_dot * body.p + 2 * (K_ddot * body.pdot) - 2 * body.p.dot(pddot_bar) * body.pdot;
}

}  // namespace mbsopt
