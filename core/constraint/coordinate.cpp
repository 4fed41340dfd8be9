#include "core/constraint/coordinate.hpp"

#include "core/body/euler_parameters.hpp"

namespace mbsopt {

void Coordinate::phi(const Frame&, const Frame& f, Vec<1>& out) const { out(0) = of(f.r, f.p); }

void Coordinate::phi_dot(const Frame&, const Frame& f, Vec<1>& out) const { out(0) = of(f.rdot, f.pdot); }

void Coordinate::phi_ddot(const Frame&, const Frame& f, Vec<1>& out) const { out(0) = of(f.rddot, f.pddot); }

void Coordinate::jacobian(const Frame&, const Frame& f, Mat<1, 6>& J1, Mat<1, 6>& J2) const {
  J1.setZero();
  J2.setZero();
  if (index < 3) {
    J2(0, index) = 1;
  } else {
    for (int j = 0; j < 3; ++j) J2(0, 3 + j) = 0.5 * G_transposed_times(f.p, Vector3d::Unit(j))(index - 3);
  }
}

void Coordinate::pull_back(const Frame&, const Frame&, const Multipliers<1>& z, FrameBar&, FrameBar& bar,
                           GeometryBar&) const {
  if (index < 3) {
    bar.r(index) += z.mu0(0);
    bar.rdot(index) += z.mu1(0);
  } else {
    bar.p(index - 3) += z.mu0(0);
    bar.pdot(index - 3) += z.mu1(0);
    bar.pddot(index - 3) += z.mu2(0);
    bar.p_eta(index - 3) += z.lambda(0);
  }
}

void Coordinate::tangent(const Frame&, const Frame&, const FrameTangent&, const FrameTangent& t, const GeometryTangent&,
                         const Vec<1>& lambda, PrimitiveTangent<1>& out) const {
  out.load1.setZero();
  out.load2.setZero();
  if (index < 3) {
    out.phi = t.r.row(index);
    out.phi_dot = t.rdot.row(index);
    out.phi_ddot.setZero();
    return;
  }
  const int k = index - 3;
  out.phi = t.p.row(k);
  out.phi_dot = t.pdot.row(k);
  out.phi_ddot = t.pddot.row(k);
  // (G(p)' e_j)_k is linear in p: p'g with g = G_transposed_times_adjoint(e_j, e_k)
  for (int j = 0; j < 3; ++j) {
    const Vector4d g = G_transposed_times_adjoint(Vector3d::Unit(j), Vector4d::Unit(k));
    out.load2.row(3 + j) = (0.5 * lambda(0)) * (g.transpose() * t.p);
  }
}

}  // namespace mbsopt
