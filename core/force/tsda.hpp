// Translational spring-damper-actuator between point 1 of body 1 and point 2 of body 2.
//   d = P2 - P1,  l = |d|,  u = d/l,  ldot = u'ddot         tension f = k (l - l0) + c ldot + actuator, or a law [N]
//   virtual work  -f u'(P2_eta - P1_eta): force -f u at P2, +f u at P1
// A spring of zero length has no direction: u = 0 there, so it has no force. That is the limit where l0 = 0; then,
// without actuator and damper, the force is k d and its derivative k I is used. Haug, "Computer Aided Kinematics and
// Dynamics of Mechanical Systems" (1989), section 11.3.
#pragma once

#include "core/body/frame.hpp"
#include "core/force/law.hpp"

namespace mbsopt {

struct TsdaForce {
  int force = 0;  // index in the scene
  int body1 = 0, body2 = 0;
  Vector3d s1, s2;  // the points, from each centre of mass, body axes [m]
  int slot1 = -1, slot2 = -1;
  Law law;

  struct Span {
    Vector3d d, ddot, u;
    double l, ldot;
  };
  Span span(const Frame& f1, const Frame& f2) const;
  // Without free length, actuator and damping the force is k d, smooth at zero length, too.
  bool is_k_times_d() const { return !law.program && law.x0 == 0 && law.f0 == 0 && law.c == 0; }

  // Adds the loads (force in global axes, moment in body axes) on each body.
  void add_load(double t, const Eigen::VectorXd& rho, const Frame& f1, const Frame& f2, Law::Scratch& scratch,
                Vec<6>& load1, Vec<6>& load2) const;

  // Gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(double t, const Eigen::VectorXd& rho, const Frame& f1, const Frame& f2, Law::Scratch& scratch,
                 FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const;

  // Tangent of the loads. f: the law's value and derivatives at x = span(f1, f2); df: its derivative through its own
  // fields and parameters in each direction (Law::field_tangent).
  void tangent(const Span& x, const Law::Value& f, Lanes<1> df, const Frame& f1, const Frame& f2,
               const FrameTangent& t1, const FrameTangent& t2, const Lanes<3>* ds1, const Lanes<3>* ds2,
               Lanes<6>& load1, Lanes<6>& load2) const;

 private:
  static void add_point(const Frame& f, const Vector3d& s, double sign, int slot, const Vector3d& d, const Vector3d& dd,
                        const Vector3d& eta, FrameBar& bar, Eigen::VectorXd& theta_bar);
};

}  // namespace mbsopt
