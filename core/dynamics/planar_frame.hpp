// The view that constraints and forces have of a body that moves in a plane, with tangents and cotangents: the planar
// counterpart of frame.hpp. A = P^2 is a rotation times |P|^2, as A(p) is in space: both models compute the same
// numbers.
#pragma once

#include "core/body/complex.hpp"

namespace mbsopt {

// A body's motion as primitives see it; T = LaneDual: with its tangent.
template <class T>
struct PlanarFrame {
  Complex<T> r, rdot, A{1, 0}, Adot, Addot;
  Plane rddot;  // given, like the angular acceleration: tangents hold it fixed

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
};

// A virtual displacement.
struct PlanarShift {
  Plane r;
  double turn = 0;
  PlanarShift() = default;
  explicit PlanarShift(const Vec<3>& x) : r{x(0), x(1)}, turn(x(2)) {}
};

// Cotangents of x, xd, xdd of a vector or separation, and of its virtual change.
struct PlanarJetBar {
  Plane x, xd, xdd, eta;
};
inline void add_vector_bar(const PlanarFrame<double>& f, double turn, const Plane& s, const PlanarJetBar& bar,
                           double sign, PlanarFrameBar& frame_bar, Plane& s_bar) {
  const Plane st = conj(sign * s);
  frame_bar.A += bar.x * st, frame_bar.Adot += bar.xd * st, frame_bar.Addot += bar.xdd * st;
  frame_bar.A_eta += bar.eta * st;
  s_bar += sign *
           (conj(f.A) * bar.x + conj(f.Adot) * bar.xd + conj(f.Addot) * bar.xdd + conj(times_i(turn * f.A)) * bar.eta);
}
inline void add_point_bar(const PlanarFrame<double>& f, double turn, const Plane& s, const PlanarJetBar& bar,
                          double sign, PlanarFrameBar& frame_bar, Plane& s_bar) {
  frame_bar.r += sign * bar.x;
  frame_bar.rdot += sign * bar.xd;
  add_vector_bar(f, turn, s, bar, sign, frame_bar, s_bar);
}

}  // namespace mbsopt
