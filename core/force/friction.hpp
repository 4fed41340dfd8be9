// Dry and viscous friction about or along a joint's axis, independent of the load.
//   f = level rate/w + viscous rate,     w = sqrt(rate^2 + smooth^2)     resists the motion   [N m], [N]
//   level = coulomb + (breakaway - coulomb) exp(-(rate/stribeck)^2)      falls with the rate: Stribeck's curve
// Armstrong-Helouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation methods for the
// control of machines with friction", Automatica 30 (1994) 1083, equation 5 with exponent 2. The rate `smooth` smooths
// Coulomb's jump at rest: at |rate| = smooth the dry part is 1/sqrt(2) of its level, at 10 smooth 0.5 % below it. So a
// joint that should stick turns slowly: at the rate  smooth tau/sqrt(coulomb^2 - tau^2) under a torque tau < coulomb =
// breakaway. Stiffness of the equations at rest: f_rate = breakaway/smooth + viscous.
#pragma once

#include "core/force/law.hpp"

namespace mbsopt {

// A law for JointEffort that depends on the rate alone.
struct FrictionLaw {
  static constexpr int kFields = 5;
  double coulomb = 0, smooth = 1, viscous = 0;  // [N m], [rad/s], [N m s/rad], or [N], [m/s], [N s/m]
  double breakaway = 0, stribeck = 1;           // [N m], [rad/s], or [N], [m/s]
  int slot = -1;                                // first of their five rows among the differentiated fields

  double value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  Law::Value derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const;
  void add_field_gradient(double, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                          Eigen::VectorXd&) const;
  double potential(double) const { return 0; }
  double potential_slope(double) const { return 0; }
  Vec<kFields> potential_gradient(double) const { return Vec<kFields>::Zero(); }
  double stiffness() const { return 0; }
  bool conserves_energy() const { return false; }

  bool moves(const ParameterBlock& block) const { return block.moves(slot, kFields); }
  template <class RhoDirection>
  Lanes<1> field_tangent(const Law::Point& at, const Lanes<kFields>* fields, RhoDirection&&,
                         const Law::Scratch&) const {
    return fields ? Lanes<1>(field_gradient(at.xdot).transpose() * *fields) : Lanes<1>(Lanes<1>::Zero());
  }

 private:
  struct Parts {
    double w, u, s;      // sqrt(rate^2 + smooth^2), rate/w, smooth/w
    double fall, level;  // fall = exp(-x^2), x = rate/stribeck
    double bulge;        // 2 (breakaway - coulomb) x^2 fall = -rate d(level)/d(rate)
  };
  Parts parts(double rate) const;
  Vec<kFields> field_gradient(double rate) const;  // df/d(coulomb, smooth, viscous, breakaway, stribeck)
};

}  // namespace mbsopt
