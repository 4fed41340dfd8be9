// Bushing: springs and dampers along and about the three axes of body 1, between point 1 of body 1 and point 2 of body
// 2.
//   d     = A1'(P2 - P1)                     ddot its rate as body 1 sees it, = A1dot'(P2 - P1) + A1'(P2dot - P1dot)
//   R     = A1'A2 R0'                        R0 = A1'A2 as the file places the bodies, so that R = I there
//   theta = g(c) a                           rotation vector of R: a = vee(R - R')/2 = sin(phi) n,  c = (tr R - 1)/2
//           g(c) = arccos(c)/sqrt(1 - c^2) = phi/sin(phi), analytic for c > -1, with g = 1 at rest
//   V     = (d'K d + theta'Kt theta)/2       D = (ddot'C ddot + thetadot'Ct thetadot)/2      all four diagonal
//   virtual work  -f'd_eta - tau'theta_eta,  f = K d + C ddot [N],  tau = Kt theta + Ct thetadot [N m]
//
// d_eta and theta_eta are the coordinates' virtual changes. So the loads are the exact gradient of V: a bushing without
// damping conserves energy. The dampers take power 2 D. The wrench on the two bodies balances at any deflection. The
// torque on body 2 is -J'tau with the Jacobian J of the rotation vector; it equals -tau only if theta is small.
//
// The bushing is singular at a relative rotation of half a turn, where theta jumps from pi n to -pi n: keep below it.
// One rotation vector measures rotations about several axes at once. At some tens of degrees it is not a sequence of
// angles: Bauchau, "Flexible Multibody Dynamics" (2011), section 13.3.
#pragma once

#include <algorithm>
#include <array>

#include "core/body/frame.hpp"
#include "core/force/force_inputs.hpp"

namespace mbsopt {

struct Bushing {
  int force = 0;  // index in the scene
  int body1 = 0, body2 = 0;
  Vector3d s1 = Vector3d::Zero(), s2 = Vector3d::Zero();  // the points, from each centre of mass [m]
  Matrix3d R0 = Matrix3d::Identity();                     // relative orientation without torque
  Vector3d K = Vector3d::Zero(), C = Vector3d::Zero();    // [N/m], [N s/m]
  Vector3d Kt = Vector3d::Zero(), Ct = Vector3d::Zero();  // [N m/rad], [N m s/rad]
  int slot1 = -1, slot2 = -1, slot_R0 = -1 /* 9, row by row */, slot_law = -1 /* K, C, Kt, Ct */;

  std::array<int, 2> bodies() const { return {body1, body2}; }
  void add_load(const ForceInputs&, const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const;

  // Adds the gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(const ForceInputs&, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                 Eigen::VectorXd& theta_bar, Eigen::VectorXd&) const;

  struct At {};
  At at(const ForceInputs&, const Frame&, const Frame&) const { return {}; }
  // Directions of the fields; a null one is constant.
  struct FieldLanes {
    const Lanes<3>*s1 = nullptr, *s2 = nullptr;
    const Lanes<9>* R0 = nullptr;
    const Lanes<12>* law = nullptr;
  };
  void tangent(const At&, const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const;
  void add_field_tangent(const ForceInputs& in, const ParameterBlock& block, const Frame& f1, const Frame& f2,
                         Lanes<6>& load1, Lanes<6>& load2) const;

  double potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2) const;  // V [J]
  void pull_back_potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                           FieldGradient& fields) const;
  bool conserves_energy() const { return C.isZero(0) && Ct.isZero(0); }
  double natural_energy(const Frame&, const Frame&) const {
    return Kt.maxCoeff() + K.maxCoeff() * std::max(s1.squaredNorm(), s2.squaredNorm());
  }

 private:
  struct Coordinates;
  struct CoordinateBars;
  Coordinates coordinates(const Frame& f1, const Frame& f2) const;
  // Adds the gradient of a scalar, given that in the coordinates. `fields` is a ThetaGradient or a FieldGradient.
  void spread(const Coordinates& x, const CoordinateBars& bars, const Frame& f1, const Frame& f2, FrameBar& bar1,
              FrameBar& bar2, auto&& fields) const;
};

}  // namespace mbsopt
