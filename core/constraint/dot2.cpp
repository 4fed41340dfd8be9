#include "core/constraint/dot2.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

void Dot2::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = (f1.A * s3).dot(f2.point(s2) - f1.point(s1));
}

void Dot2::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = (f1.Adot * s3).dot(f2.point(s2) - f1.point(s1)) + (f1.A * s3).dot(f2.point_dot(s2) - f1.point_dot(s1));
}

void Dot2::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const VectorJet w(f1, s3), d = separation(f1, f2, s1, s2);
  out(0) = w.xdd.dot(d.x) + 2 * w.xd.dot(d.xd) + w.x.dot(d.xdd);
}

void Dot2::jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  const Vector3d w = f1.A * s3, d = f2.point(s2) - f1.point(s1);
  J1.leftCols<3>() = -w.transpose();
  J1.rightCols<3>() = (s3.cross(f1.A.transpose() * d) - s1.cross(f1.A.transpose() * w)).transpose();
  J2.leftCols<3>() = w.transpose();
  J2.rightCols<3>() = s2.cross(f2.A.transpose() * w).transpose();
}

void Dot2::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                     GeometryBar& s) const {
  const VectorJet w(f1, s3), d = separation(f1, f2, s1, s2), d_bar = product_bar(w, z);
  add_vector_bar(f1, s3, product_bar(d, z), 1, bar1, s.s3);
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

void Dot2::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                   const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  const VectorJet w(f1, s3), d = separation(f1, f2, s1, s2);
  const VectorTangent dw(f1, t1, s3, s.s3), dd = separation_tangent(f1, f2, t1, t2, s1, s2, s);
  product_tangent(w, d, dw, dd, out);
  out.load1.topRows<3>() = -lambda(0) * dw.x;
  out.load2.topRows<3>() = lambda(0) * dw.x;
  out.load1.bottomRows<3>() =
      lambda(0) * (moment_tangent(f1, t1, s3, s.s3, d.x, dd.x) - moment_tangent(f1, t1, s1, s.s1, w.x, dw.x));
  out.load2.bottomRows<3>() = lambda(0) * moment_tangent(f2, t2, s2, s.s2, w.x, dw.x);
}

}  // namespace mbsopt
