#include "core/constraint/distance.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {

void Distance::phi(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = (f2.point(s2) - f1.point(s1)).norm();
}

void Distance::phi_dot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  out(0) = direction(f2.point(s2) - f1.point(s1)).dot(f2.point_dot(s2) - f1.point_dot(s1));
}

void Distance::phi_ddot(const Frame& f1, const Frame& f2, Vec<1>& out) const {
  const VectorJet d = separation(f1, f2, s1, s2);
  const double l = d.x.norm(), ldot = direction(d.x).dot(d.xd);
  out(0) = direction(d.x).dot(d.xdd) + (l > 0 ? (d.xd.squaredNorm() - ldot * ldot) / l : 0);
}

void Distance::jacobian(const Frame& f1, const Frame& f2, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  const Vector3d u = direction(f2.point(s2) - f1.point(s1));
  J1 << -u.transpose(), -s1.cross(f1.A.transpose() * u).transpose();
  J2 << u.transpose(), s2.cross(f2.A.transpose() * u).transpose();
}

void Distance::pull_back(const Frame& f1, const Frame& f2, const Multipliers<1>& z, FrameBar& bar1, FrameBar& bar2,
                         GeometryBar& s) const {
  const VectorJet d = separation(f1, f2, s1, s2);
  const double l = d.x.norm();
  if (l == 0) return;
  const double lambda = z.lambda(0), mu0 = z.mu0(0), mu1 = z.mu1(0), mu2 = z.mu2(0);
  const Vector3d u = d.x / l;
  auto across = [&](const Vector3d& x) { return Vector3d((x - u * u.dot(x)) / l); };  // u_d x
  const double ldot = u.dot(d.xd), c = (d.xd.squaredNorm() - ldot * ldot) / l;
  // l_d = u,  (ldot)_d = across(ddot),  (lddot)_d = across(dddot) - 2 ldot across(ddot)/l - c u/l
  // (lddot)_ddot = 2 (ddot - ldot u)/l
  const VectorJet d_bar{Vector3d(lambda * across(d.x_eta) + mu0 * u + mu1 * across(d.xd) +
                                 mu2 * (across(d.xdd) - (2 * ldot / l) * across(d.xd) - (c / l) * u)),
                        Vector3d(mu1 * u + 2 * mu2 * across(d.xd)), Vector3d(mu2 * u), Vector3d(lambda * u)};
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

void Distance::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                       const GeometryTangent& s, const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  const VectorJet d = separation(f1, f2, s1, s2);
  const VectorTangent dd = separation_tangent(f1, f2, t1, t2, s1, s2, s);
  const double l = d.x.norm(), over_l = l > 0 ? 1 / l : 0;
  const Vector3d u = direction(d.x);
  const double ldot = u.dot(d.xd), c = (d.xd.squaredNorm() - ldot * ldot) * over_l;
  const Lanes<1> dl = dot(u, dd.x);
  const Lanes<3> du = (dd.x - u * dl) * over_l;
  const Lanes<1> dldot = dot(d.xd, du) + dot(u, dd.xd);
  out.phi = dl;
  out.phi_dot = dldot;
  out.phi_ddot = dot(d.xdd, du) + dot(u, dd.xdd) + over_l * (2 * dot(d.xd, dd.xd) - 2 * ldot * dldot - c * dl);
  const Lanes<3> dF = lambda(0) * du;
  const Vector3d F = lambda(0) * u;
  out.load1.topRows<3>() = -dF;
  out.load2.topRows<3>() = dF;
  out.load1.bottomRows<3>() = -moment_tangent(f1, t1, s1, s.s1, F, dF);
  out.load2.bottomRows<3>() = moment_tangent(f2, t2, s2, s.s2, F, dF);
}

Vector3d Distance::direction(const Vector3d& d) {
  const double l = d.norm();
  return l > 0 ? Vector3d(d / l) : Vector3d(Vector3d::Zero());
}

}  // namespace mbsopt
