#include "core/constraint/dot1.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {
namespace {

// (x'y)ddot in p and pdot of the body of x = A s, as VectorBlocks:  y'N(p, s) = (K(y s') p)', K as in
// euler_parameters.hpp
void product_rows(const VectorJet& y, const BodyState& b, const Vector3d& s, const Vector3d& x, Mat<1, 4>& by_p,
                  Mat<1, 4>& by_pdot) {
  const Vector3d turned = b.omegadot.cross(s) - 2 * b.pdot.squaredNorm() * s;
  const Mat<4, 4> K_x = K(y.x * s.transpose()), K_xd = 2 * K(y.xd * s.transpose());
  by_p = (K(y.x * turned.transpose() + y.xdd * s.transpose()) * b.p + K_xd * b.pdot).transpose();
  by_pdot = (2 * (K_x * b.pdot) + K_xd * b.p - (4 * y.x.dot(x)) * b.pdot).transpose();
}

}  // namespace

void Dot1::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const Vector3d x = f1.A * s1, y = f2.A * s2;
  out(0) = x.dot(y);
}

void Dot1::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const Vector3d x = f1.A * s1, y = f2.A * s2, xd = f1.Adot * s1, yd = f2.Adot * s2;
  out(0) = xd.dot(y) + x.dot(yd);
}

void Dot1::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const VectorJet x(f1, s1), y(f2, s2);
  out(0) = x.xdd.dot(y.x) + 2 * x.xd.dot(y.xd) + x.x.dot(y.xdd);
}

double Dot1::change(const Frame& f1, const Frame& f2) const {
  const Vector3d x = f1.A * s1, y = f2.A * s2, x_eta = f1.A_eta * s1, y_eta = f2.A_eta * s2;
  return x_eta.dot(y) + x.dot(y_eta);
}

void Dot1::jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  const Vector3d x = f1.A * s1, y = f2.A * s2;
  J1.leftCols<3>().setZero(), J2.leftCols<3>().setZero();
  J1.rightCols<3>() = s1.cross(f1.A.transpose() * y).transpose();
  J2.rightCols<3>() = s2.cross(f2.A.transpose() * x).transpose();
}

void Dot1::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                     GeometryBar& s) const {
  const VectorJet x(f1, s1), y(f2, s2);
  add_vector_bar(f1, s1, product_bar(y, z), 1, bar1, s.s1);
  add_vector_bar(f2, s2, product_bar(x, z), 1, bar2, s.s2);
}

void Dot1::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                   const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  const VectorJet x(f1, s1), y(f2, s2);
  const VectorTangent dx(f1, t1, s1, s.s1), dy(f2, t2, s2, s.s2);
  product_tangent(x, y, dx, dy, out);
  out.load1.setZero(), out.load2.setZero();
  out.load1.bottomRows<3>() = lambda(0) * moment_tangent(f1, t1, s1, s.s1, y.x, dy.x);
  out.load2.bottomRows<3>() = lambda(0) * moment_tangent(f2, t2, s2, s.s2, x.x, dx.x);
}

void Dot1::turning_blocks(const BodyState& b1, const Frame& f1, const BodyState& b2, const Frame& f2,
                          const Vec<1>& lambda, TurningBlocks<1>& out) const {
  const VectorJet x(f1, s1), y(f2, s2);
  product_rows(y, b1, s1, x.x, out.p1, out.pdot1);
  product_rows(x, b2, s2, y.x, out.p2, out.pdot2);
  const Matrix3d S1 = lambda(0) * skew(s1), S2 = lambda(0) * skew(s2);
  out.moment1_p1 = S1 * N_transposed(b1.p, y.x);
  out.moment1_p2 = S1 * (f1.A.transpose() * N(b2.p, s2));
  out.moment2_p2 = S2 * N_transposed(b2.p, x.x);
  out.moment2_p1 = S2 * (f2.A.transpose() * N(b1.p, s1));
}

}  // namespace mbsopt
