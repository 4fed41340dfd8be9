// An impact at a limit with the gap g, G its gradient in virtual displacements, e its restitution (Newton's law):
//
//   M v+ + J'L - G'Ln = M v-        J v+ = -Phi_t        G v+ + g_t = -e (G v- + g_t)
//
// The accelerations are linear in the force mu along g. So W G' = (a(mu) - a(-mu))/(2 mu) for any mu is the change of
// velocity by a unit impulse, W the inverse of M that the joints leave. With c = G W G' and r = G v- + g_t,
//
//   v+ = v- + W G' Ln               Ln = -(1 + e) r/c
#pragma once

#include <Eigen/Core>

#include "core/dynamics/dynamics.hpp"
#include "core/event/switches.hpp"

namespace mbsopt {

struct Impact {
  double mu = 1;      // makes the changes of the accelerations much larger than themselves
  Eigen::VectorXd w;  // W G' as a change of qdot
  double r = 0, c = 0;
  double Ln = 0;          // [N s], [N m s]
  Eigen::VectorXd after;  // y after the impact
};

// Returns false if joints leave no motion along the gap.
bool set_impact(Switches& switches, std::size_t limit, Dynamics& dynamics, const StatePoint& before, Impact& impact);

}  // namespace mbsopt
