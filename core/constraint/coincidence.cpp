#include "core/constraint/coincidence.hpp"

#include "core/constraint/body_vector.hpp"

namespace mbsopt {
namespace {

// Derivatives of xdd, x = A s, in p and pdot with omegadot held fixed. Both are values of N, since
//   Addot = A(p) (skew(omegadot) - 2 (pdot'pdot)) + 2 A(pdot)
struct VectorBlocks {
  Mat<3, 4> xdd_p, xdd_pdot;
  VectorBlocks(const Frame& f, const Vector3d& s)
      : xdd_p(N(f.p, f.omegadot.cross(s) - 2 * f.pdot.squaredNorm() * s)),
        xdd_pdot(2 * N(f.pdot, s) - 4 * (f.A * s) * f.pdot.transpose()) {}
};

}  // namespace

void Coincidence::phi(const Frame& f1, const Frame& f2, Vec<3>& out) const { out = f2.point(s2) - f1.point(s1); }

void Coincidence::phi_dot(const Frame& f1, const Frame& f2, Vec<3>& out) const {
  out = f2.point_dot(s2) - f1.point_dot(s1);
}

void Coincidence::phi_ddot(const Frame& f1, const Frame& f2, Vec<3>& out) const {
  out = f2.point_ddot(s2) - f1.point_ddot(s1);
}

void Coincidence::jacobian(const Frame& f1, const Frame& f2, Mat<3, 6>& J1, Mat<3, 6>& J2) const {
  J1 << -Matrix3d::Identity(), f1.A * skew(s1);
  J2 << Matrix3d::Identity(), -f2.A * skew(s2);
}

void Coincidence::pull_back(const Frame& f1, const Frame& f2, const Multipliers<3>& z, FrameBar& bar1, FrameBar& bar2,
                            GeometryBar& s) const {
  const VectorJet d_bar{{z.mu0, z.mu1, z.mu2}, z.lambda};
  add_point_bar(f2, s2, d_bar, 1, bar2, s.s2);
  add_point_bar(f1, s1, d_bar, -1, bar1, s.s1);
}

void Coincidence::tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                          const GeometryTangent& s, const Vec<3>& lambda, PrimitiveTangent<3>& out) const {
  const DualFrame g1{f1, t1}, g2{f2, t2};
  const BodyVector v1{s1, s.s1}, v2{s2, s.s2};
  const Jet<DualVector> d = separation(g1, g2, v1, v2);
  out.phi = d.x.d;
  out.phi_dot = d.xd.d;
  out.phi_ddot = d.xdd.d;
  out.load1 << Lanes<3>::Zero(), -moment(g1, v1, lambda).d;
  out.load2 << Lanes<3>::Zero(), moment(g2, v2, lambda).d;
}

void Coincidence::turning_blocks(const Frame& f1, const Frame& f2, const Vec<3>& lambda, TurningBlocks<3>& out) const {
  const VectorBlocks x(f1, s1), y(f2, s2);
  out.p1 = -x.xdd_p;
  out.pdot1 = -x.xdd_pdot;
  out.p2 = y.xdd_p;
  out.pdot2 = y.xdd_pdot;
  out.moment1_p1 = -skew(s1) * N_transposed(f1.p, lambda);
  out.moment2_p2 = skew(s2) * N_transposed(f2.p, lambda);
  out.moment1_p2.setZero();
  out.moment2_p1.setZero();
}

}  // namespace mbsopt
