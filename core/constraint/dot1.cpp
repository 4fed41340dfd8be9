#include "core/constraint/dot1.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

void Dot1::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const { out(0) = (f1.A * s1).dot(f2.A * s2); }

void Dot1::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = (f1.Adot * s1).dot(f2.A * s2) + (f1.A * s1).dot(f2.Adot * s2);
}

void Dot1::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = (f1.Addot * s1).dot(f2.A * s2) + 2 * (f1.Adot * s1).dot(f2.Adot * s2) + (f1.A * s1).dot(f2.Addot * s2);
}

double Dot1::change(const Frame& f1, const Frame& f2) const {
  return (f1.A_eta * s1).dot(f2.A * s2) + (f1.A * s1).dot(f2.A_eta * s2);
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
  const VectorBlocks dx(b1, f1, s1), dy(b2, f2, s2);
  const VectorJet x(f1, s1), y(f2, s2);
  out.p1 = y.x.transpose() * dx.xdd_p + 2 * y.xd.transpose() * dx.xd_p + y.xdd.transpose() * dx.x_p;
  out.p2 = x.x.transpose() * dy.xdd_p + 2 * x.xd.transpose() * dy.xd_p + x.xdd.transpose() * dy.x_p;
  out.pdot1 = y.x.transpose() * dx.xdd_pdot + 2 * y.xd.transpose() * dx.x_p;
  out.pdot2 = x.x.transpose() * dy.xdd_pdot + 2 * x.xd.transpose() * dy.x_p;
  const Matrix3d S1 = lambda(0) * skew(s1), S2 = lambda(0) * skew(s2);
  out.moment1_p1 = S1 * N_transposed(b1.p, y.x);
  out.moment1_p2 = S1 * (f1.A.transpose() * dy.x_p);
  out.moment2_p2 = S2 * N_transposed(b2.p, x.x);
  out.moment2_p1 = S2 * (f2.A.transpose() * dx.x_p);
}

}  // namespace mbsopt
