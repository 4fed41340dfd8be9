// A planar frame is a body as constraints and forces of the plane see it, with tangents and cotangents: the planar
// counterpart of frame.hpp. A = P^2 is a rotation times |P|^2, as A(p) is in space. So both models compute the same
// numbers.
#pragma once

#include "core/body/complex.hpp"
#include "core/body/jet.hpp"

namespace mbsopt {

// A body's motion as primitives see it; T = Dual: with its tangent.
template <class T>
struct PlanarFrame {
  Complex<T> r, rdot, A{1, 0}, Adot, Addot;
  Plane rddot;  // given, like the angular acceleration: tangents hold it fixed
  // Virtual displacement of the adjoint sweep.
  Plane r_eta;
  double theta_eta = 0;

  // The virtual change of a body-fixed vector x = A s.
  Plane turned(const Plane& x) const { return times_i(theta_eta * x); }

  //   Adot = 2 P Pdot,   Addot = 2 Pdot^2 + (i omegadot - 2 |Pdot|^2) A
  void set_turn(const Complex<T>& P, const Complex<T>& Pdot, double omegadot) {
    A = P * P;
    Adot = 2 * (P * Pdot);
    Addot = 2 * (Pdot * Pdot) + times_i(omegadot * A) - (2 * squared_norm(Pdot)) * A;
  }
};

// Gradient of a scalar in a frame and in the image A_eta = i A eta_theta of a virtual turn.
struct PlanarFrameBar {
  Plane r, rdot, A, Adot, Addot, A_eta;
  void set_zero() { *this = {}; }
};

inline void set_virtual(const Vec<3>& eta, PlanarFrame<double>& f) {
  f.r_eta = {eta(0), eta(1)};
  f.theta_eta = eta(2);
}
// The cotangent of A_eta moved to A, eta_theta held fixed.
inline void fold_virtual(const PlanarFrame<double>& f, PlanarFrameBar& bar) {
  bar.A -= f.theta_eta * times_i(bar.A_eta);
}

// Add the cotangents of a vector A s, or of a point, to the frame and to s.
inline void add_vector_bar(const PlanarFrame<double>& f, const Plane& s, const MovedJet<Plane>& bar, double sign,
                           PlanarFrameBar& frame_bar, Plane& s_bar) {
  const Plane st = conj(sign * s);
  frame_bar.A += bar.x * st;
  frame_bar.Adot += bar.xd * st;
  frame_bar.Addot += bar.xdd * st;
  frame_bar.A_eta += bar.x_eta * st;
  s_bar +=
      sign * (conj(f.A) * bar.x + conj(f.Adot) * bar.xd + conj(f.Addot) * bar.xdd + conj(f.turned(f.A)) * bar.x_eta);
}
inline void add_point_bar(const PlanarFrame<double>& f, const Plane& s, const MovedJet<Plane>& bar, double sign,
                          PlanarFrameBar& frame_bar, Plane& s_bar) {
  frame_bar.r += sign * bar.x;
  frame_bar.rdot += sign * bar.xd;
  add_vector_bar(f, s, bar, sign, frame_bar, s_bar);
}

}  // namespace mbsopt
