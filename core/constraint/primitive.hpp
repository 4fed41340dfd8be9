// What a constraint primitive must offer. A primitive is a few scalar functions of two bodies' frames and of up to
// three body-fixed vectors s1, s2, s3 of its own; the ground is a frame that never moves. Set to zero, or to a law of
// time, it is a constraint; a single one is also what sensors and forces measure. Bodies move by virtual displacements
// (eta_r, eta_theta in body axes), so the unit-norm equations never appear here.
//
//   phi, phi_dot, phi_ddot   Phi and its total time derivatives, for the frames' velocities and accelerations
//   jacobian                 J1, J2 (rows x 6): Phi_eta of each body
//   pull_back                gradient of  lambda'(J1 eta1 + J2 eta2) + mu0'Phi + mu1'Phidot + mu2'Phiddot
//                            in the frames (eta held fixed) and in s1, s2, s3: all that the adjoint sweep needs
//   tangent                  the same information forward: Phi', Phidot', Phiddot' and (J' lambda)' in kLanes
//                            directions
#pragma once

#include <concepts>

#include "core/body/frame.hpp"

namespace mbsopt {

template <int Rows>
struct Multipliers {
  Vec<Rows> lambda, mu0, mu1, mu2;
  static Multipliers zero() { return {Vec<Rows>::Zero(), Vec<Rows>::Zero(), Vec<Rows>::Zero(), Vec<Rows>::Zero()}; }
};

// Gradient in the vectors of a primitive.
struct GeometryBar {
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero(), s3 = Vector3d::Zero();
};

// Derivative directions of the vectors; null where one depends on no active parameter.
struct GeometryTangent {
  const Lanes<3>* s1 = nullptr;
  const Lanes<3>* s2 = nullptr;
  const Lanes<3>* s3 = nullptr;
};

template <int Rows>
struct PrimitiveTangent {
  Lanes<Rows> phi, phi_dot, phi_ddot;
  Lanes<6> load1, load2;  // (J1' lambda)', (J2' lambda)'
};

template <class P>
concept IsPrimitive = requires(const P& primitive, const Frame& f, Vec<P::kRows>& phi, Mat<P::kRows, 6>& J,
                               const Multipliers<P::kRows>& z, FrameBar& bar, GeometryBar& s_bar, const FrameTangent& t,
                               const GeometryTangent& s, PrimitiveTangent<P::kRows>& out) {
  primitive.phi(f, f, phi);
  primitive.phi_dot(f, f, phi);
  primitive.phi_ddot(f, f, phi);
  primitive.jacobian(f, f, J, J);
  primitive.pull_back(f, f, z, bar, bar, s_bar);
  primitive.tangent(f, f, t, t, s, z.lambda, out);
};

// J1 eta1 + J2 eta2 of a primitive, eta as set in the frames (set_virtual).
template <class P>
Vec<P::kRows> virtual_change(const P& p, const Frame& f1, const Frame& f2) {
  Mat<P::kRows, 6> J1, J2;
  p.jacobian(f1, f2, J1, J2);
  Vec<6> eta1, eta2;
  eta1 << f1.r_eta, f1.theta_eta;
  eta2 << f2.r_eta, f2.theta_eta;
  return J1 * eta1 + J2 * eta2;
}

// A body-fixed vector x = A s along the motion, under a virtual displacement and in tangent directions.
struct VectorJet {
  Vector3d x, xd, xdd, x_eta;
  VectorJet(const Frame& f, const Vector3d& s) : x(f.A * s), xd(f.Adot * s), xdd(f.Addot * s), x_eta(f.A_eta * s) {}
  VectorJet(Vector3d v, Vector3d d, Vector3d dd, Vector3d eta)
      : x(std::move(v)), xd(std::move(d)), xdd(std::move(dd)), x_eta(std::move(eta)) {}
};
struct VectorTangent {
  Lanes<3> x, xd, xdd;
  VectorTangent(const Frame& f, const FrameTangent& t, const Vector3d& s, const Lanes<3>* ds)
      : x(times(t.A, s)), xd(times(t.Adot, s)), xdd(times(t.Addot, s)) {
    if (ds) x += f.A * *ds, xd += f.Adot * *ds, xdd += f.Addot * *ds;
  }
};

// d = P2 - P1 of two body points; its second derivative without the part of rddot', which tangents hold fixed.
inline VectorJet separation(const Frame& f1, const Frame& f2, const Vector3d& s1, const Vector3d& s2) {
  return {f2.point(s2) - f1.point(s1), f2.point_dot(s2) - f1.point_dot(s1), f2.point_ddot(s2) - f1.point_ddot(s1),
          f2.point_eta(s2) - f1.point_eta(s1)};
}
inline VectorTangent separation_tangent(const Frame& f1, const Frame& f2, const FrameTangent& t1,
                                        const FrameTangent& t2, const Vector3d& s1, const Vector3d& s2,
                                        const GeometryTangent& s) {
  VectorTangent d(f2, t2, s2, s.s2);
  const VectorTangent d1(f1, t1, s1, s.s1);
  d.x += t2.r - t1.r - d1.x;
  d.xd += t2.rdot - t1.rdot - d1.xd;
  d.xdd -= d1.xdd;
  return d;
}

// Cotangents of x, xd, xdd, x_eta of a body-fixed vector, or times sign those of a body point, to its frame and to s.
inline void add_vector_bar(const Frame& f, const Vector3d& s, const VectorJet& bar, double sign, FrameBar& frame_bar,
                           Vector3d& s_bar) {
  const Vector3d st = sign * s;
  frame_bar.A += bar.x * st.transpose();
  frame_bar.Adot += bar.xd * st.transpose();
  frame_bar.Addot += bar.xdd * st.transpose();
  frame_bar.A_eta += bar.x_eta * st.transpose();
  s_bar += sign * (f.A.transpose() * bar.x + f.Adot.transpose() * bar.xd + f.Addot.transpose() * bar.xdd +
                   f.A_eta.transpose() * bar.x_eta);
}
inline void add_point_bar(const Frame& f, const Vector3d& s, const VectorJet& bar, double sign, FrameBar& frame_bar,
                          Vector3d& s_bar) {
  frame_bar.r += sign * bar.x;
  frame_bar.rdot += sign * bar.xd;
  add_vector_bar(f, s, bar, sign, frame_bar, s_bar);
}

// Tangent of the moment s x A'F (body axes) of a force F at s.
inline Lanes<3> moment_tangent(const Frame& f, const FrameTangent& t, const Vector3d& s, const Lanes<3>* ds,
                               const Vector3d& F, const Lanes<3>& dF) {
  Lanes<3> m = cross(s, transposed_times(t.A, F) + f.A.transpose() * dF);
  if (ds) m -= cross(f.A.transpose() * F, *ds);
  return m;
}

}  // namespace mbsopt
