// What a constraint primitive must offer. A primitive ties two bodies by a few scalar equations that are polynomials in
// their frames (r, A) and in two body-fixed vectors s1, s2 of its own; the ground is a frame that never moves. Bodies
// move by virtual displacements (eta_r, eta_theta in body axes), so the unit-norm equations never appear here.
//
//   phi, phi_dot, phi_ddot   Phi and its total time derivatives, for the frames' velocities and accelerations
//   jacobian                 J1, J2 (rows x 6): Phi_eta of each body
//   pull_back                gradient of  lambda'(J1 eta1 + J2 eta2) + mu0'Phi + mu1'Phidot + mu2'Phiddot
//                            in the frames (eta held fixed) and in s1, s2: all that the adjoint sweep needs
//   tangent                  the same information forward: Phi', Phidot', Phiddot' and (J' lambda)' in kLanes
//   directions
#pragma once

#include <concepts>

#include "core/body/frame.hpp"

namespace mbsopt {

template <int Rows>
struct Multipliers {
  Vec<Rows> lambda, mu0, mu1, mu2;
};

// Derivative directions of s1 and s2; null where the vector depends on no active parameter.
struct GeometryTangent {
  const Lanes<3>* s1 = nullptr;
  const Lanes<3>* s2 = nullptr;
};

template <int Rows>
struct PrimitiveTangent {
  Lanes<Rows> phi, phi_dot, phi_ddot;
  Lanes<6> load1, load2;  // (J1' lambda)', (J2' lambda)'
};

template <class P>
concept IsPrimitive = requires(const P& primitive, const Frame& f, Vec<P::kRows>& phi, Mat<P::kRows, 6>& J,
                               const Multipliers<P::kRows>& z, FrameBar& bar, Vector3d& s_bar, const FrameTangent& t,
                               const GeometryTangent& s, PrimitiveTangent<P::kRows>& out) {
  { primitive.s1 } -> std::convertible_to<Vector3d>;
  { primitive.s2 } -> std::convertible_to<Vector3d>;
  primitive.phi(f, f, phi);
  primitive.phi_dot(f, f, phi);
  primitive.phi_ddot(f, f, phi);
  primitive.jacobian(f, f, J, J);
  primitive.pull_back(f, f, z, bar, bar, s_bar, s_bar);
  primitive.tangent(f, f, t, t, s, z.lambda, out);
};

}  // namespace mbsopt
