// The concept of a constraint primitive. A primitive is a few scalar functions of two bodies' frames and of up to three
// body-fixed vectors s1, s2, s3. The ground is a frame that never moves. A primitive that is set to zero, or to a law
// of time, is a constraint. Sensors and forces measure single primitives. Bodies move by virtual displacements (eta_r,
// eta_theta in body axes), so the unit-norm equations never appear here.
//
//   phi, phi_dot, phi_ddot   Phi and its total time derivatives, for the frames' velocities and accelerations
//   jacobian                 J1, J2 (rows x 6): Phi_eta of each body
//   pull_back                gradient of  lambda'(J1 eta1 + J2 eta2) + mu0'Phi + mu1'Phidot + mu2'Phiddot
//                            in the frames (eta held fixed) and in s1, s2, s3: all that the adjoint sweep needs
//   tangent                  the same information forward: Phi, Phidot, Phiddot and J'lambda, differentiated in
//                            kLanes directions
//
// A mechanism in a plane uses core/dynamics/planar_constraints.hpp instead: the same equations in complex numbers.
// docs/architecture.md follows a dot2 from here to the gradient.
#pragma once

#include <concepts>

#include "core/body/frame.hpp"

namespace mbsopt {

// The displacements of a body that the rows of J1 or J2 depend on: none, row r on axis r only, or any.
enum class Displacements { none, own_axis, any };

// The quantity that a row measures: [m], the product of two directions [-], [rad], [-].
enum class RowQuantity { length, cosine, angle, euler_parameter };

template <int Rows>
struct Multipliers {
  Vec<Rows> lambda, mu0, mu1, mu2;
  static Multipliers zero() { return {Vec<Rows>::Zero(), Vec<Rows>::Zero(), Vec<Rows>::Zero(), Vec<Rows>::Zero()}; }
};

// The two bodies of a primitive, and the first rows of its s1, s2, s3 among the differentiated fields.
struct BodyPair {
  int body1 = 0, body2 = 0;                // 0 is the ground
  int slot1 = -1, slot2 = -1, slot3 = -1;  // -1: constant
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

// Derivatives of Phiddot and J'lambda in each body's p and pdot (4 columns), omegadot held fixed. The primitive must
// not depend on r and rdot. Its forces J'lambda are constant; moments are in body axes.
template <int Rows>
struct TurningBlocks {
  Mat<Rows, 4> p1, pdot1, p2, pdot2;                         // of Phiddot
  Mat<3, 4> moment1_p1, moment1_p2, moment2_p1, moment2_p2;  // of J'lambda
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
  { P::kDisplacements } -> std::convertible_to<Displacements>;
  { primitive.quantity() } -> std::same_as<RowQuantity>;
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

// A primitive with turning_blocks(), a short cut to its tangents in all directions.
template <class P>
concept HasTurningBlocks = requires(const P p, const Frame f, const Vec<P::kRows> lambda, TurningBlocks<P::kRows> out) {
  p.turning_blocks(f, f, lambda, out);
};

}  // namespace mbsopt
