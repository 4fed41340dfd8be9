// Translational spring-damper-actuator between point 1 of body 1 and point 2 of body 2.
//   d = P2 - P1,  l = |d|,  u = d/l,  ldot = u'ddot         tension f = k (l - l0) + c ldot + actuator, or a law [N]
//   virtual work  -f u'(P2_eta - P1_eta): force -f u at P2, +f u at P1
// A spring of zero length has no direction: there u = 0, and it has no force. That is the limit if l0 = 0. Without free
// length, actuator and damper the force is k d, and its derivative k I is used. Haug, "Computer Aided Kinematics and
// Dynamics of Mechanical Systems" (1989), section 11.3.
#pragma once

#include <array>
#include <cmath>
#include <optional>

#include "core/body/frame.hpp"
#include "core/body/jet.hpp"
#include "core/force/force_inputs.hpp"

namespace mbsopt {

// The separation of the points with its rate, in space or in the plane.
template <class V>
struct SpringSpan {
  V d, ddot, u;
  double l, ldot;
  SpringSpan(const V& separation, const V& rate)
      : d(separation), ddot(rate), u(direction(d, std::sqrt(dot(d, d)))), l(std::sqrt(dot(d, d))), ldot(dot(u, ddot)) {}
};

struct TsdaForce {
  int force = 0;  // index in the scene
  int body1 = 0, body2 = 0;
  Vector3d s1, s2;  // the points, from each centre of mass, body axes [m]
  int slot1 = -1, slot2 = -1;
  Law law;

  SpringSpan<Vector3d> span(const Frame& f1, const Frame& f2) const;
  // Without free length, actuator and damping the force is k d, smooth at zero length, too.
  bool is_k_times_d() const { return !law.program && law.x0 == 0 && law.f0 == 0 && law.c == 0; }

  std::array<int, 2> bodies() const { return {body1, body2}; }
  Law::Point measured(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2) const;
  // Gradient of x_bar l + xdot_bar ldot.
  void pull_back_measured(const Frame& f1, const Frame& f2, double x_bar, double xdot_bar, FrameBar& bar1,
                          FrameBar& bar2, FieldGradient& fields) const;

  // The gradient of the virtual work in d, its rate and d_eta (d_eta held fixed); it adds that in the law's fields.
  // There is none without a direction.
  template <class V>
  std::optional<MovedJet<V>> work_bar(double t, const Eigen::VectorXd& rho, const SpringSpan<V>& x, const V& d_eta,
                                      Law::Scratch& scratch, Eigen::VectorXd& theta_bar,
                                      Eigen::VectorXd& rho_bar) const {
    const V none = 0.0 * d_eta;
    if (x.l == 0 && !is_k_times_d()) return std::nullopt;
    if (x.l == 0) return MovedJet<V>{{V(-law.k * d_eta), none, none}, none};  // work = -k d'd_eta
    const Law::Value f = law.derivatives(t, rho, x.l, x.ldot, scratch);
    const double l_eta = dot(x.u, d_eta);
    law.add_field_gradient(x.l, x.ldot, -l_eta, scratch, theta_bar, rho_bar);
    // work = -f l_eta;   l_d = u,  (ldot)_d = (ddot - ldot u)/l,  (ldot)_ddot = u,  (l_eta)_d = (d_eta - l_eta u)/l
    return MovedJet<V>{
        {V(-l_eta * (f.f_x * x.u + (f.f_xdot / x.l) * (x.ddot - x.ldot * x.u)) - (f.f / x.l) * (d_eta - l_eta * x.u)),
         V((-l_eta * f.f_xdot) * x.u), none},
        V(-f.f * x.u)};
  }

  // Adds the loads (force in global axes, moment in body axes) on each body.
  void add_load(const ForceInputs& in, const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const;

  // Adds the gradient of the virtual work (load1'eta1 + load2'eta2) in the frames (eta held fixed) and in the fields.
  void pull_back(const ForceInputs& in, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                 Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const;

  // Directions of the law (Law::field_tangent) and of the points; a null one is constant.
  struct FieldLanes {
    Lanes<1> f = Lanes<1>::Zero();
    const Lanes<3>*s1 = nullptr, *s2 = nullptr;
  };
  Law::Value at(const ForceInputs& in, const Frame& f1, const Frame& f2) const;
  void tangent(const Law::Value& f, const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
               const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const;
  void add_field_tangent(const ForceInputs& in, const ParameterBlock& block, const Frame& f1, const Frame& f2,
                         Lanes<6>& load1, Lanes<6>& load2) const;

  double potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2) const;
  void pull_back_potential(const Eigen::VectorXd& angles, const Frame& f1, const Frame& f2, FrameBar& bar1,
                           FrameBar& bar2, FieldGradient& fields) const;
  bool conserves_energy() const { return law.conserves_energy(); }
  double natural_energy(const Frame& f1, const Frame& f2) const;

 private:
  void add_point_bars(const MovedJet<Vector3d>& bar, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                      auto&& fields) const;
};

}  // namespace mbsopt
