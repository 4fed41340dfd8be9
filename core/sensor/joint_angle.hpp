// Angle of a revolute joint, from normal1 of body 1 to normal2 of body 2, right-handed about axis1.   [rad]
//   x = A1 n1,  y = A1 (axis1 x n1),  n = A2 n2          C = n'x,  S = n'y
//   angle = atan2(S, C)  (continued over turns from a reference)      rate = (C Sdot - S Cdot)/(C^2 + S^2)
// The same expression with virtual displacements gives the angle's virtual change, so that a torsional spring is
// exactly the gradient of its potential, off the constraints as well.
#pragma once

#include <cmath>

#include "core/body/frame.hpp"

namespace mbsopt {

struct JointAngle {
  int joint = 0, body1 = 0, body2 = 0;
  Vector3d x1, y1, n2;  // n1, axis1 x n1, n2
  int slot_x1 = -1, slot_y1 = -1, slot_n2 = -1;

  // Everything that depends on the frames, once.
  struct Jet {
    Vector3d x, y, n, xd, yd, nd, x_eta, y_eta, n_eta;
    double C, S, Cd, Sd, C_eta, S_eta, D;
    double angle() const { return std::atan2(S, C); }
    double rate() const { return (C * Sd - S * Cd) / D; }
    double change() const { return (C * S_eta - S * C_eta) / D; }  // virtual change of the angle
  };
  Jet jet(const Frame& f1, const Frame& f2) const;

  // The value of angle nearest to reference among those a full turn apart.
  static double on_branch(double angle, double reference);

  struct SlotBars {
    Vector3d x1 = Vector3d::Zero(), y1 = Vector3d::Zero(), n2 = Vector3d::Zero();
  };
  // Gradient of  angle_bar angle + rate_bar rate + change_bar change  in the frames (eta held fixed) and the vectors.
  void pull_back(const Frame& f1, const Frame& f2, const Jet& j, double angle_bar, double rate_bar, double change_bar,
                 FrameBar& bar1, FrameBar& bar2, SlotBars& s) const;

 private:
  static void add(const Frame& f, const Vector3d& s, const Vector3d& x, const Vector3d& xd, const Vector3d& x_eta,
                  FrameBar& bar, Vector3d& s_bar);
};

}  // namespace mbsopt
