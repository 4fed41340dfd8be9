// How wrong the accelerations at a state are because joints hold it too weakly for simulation.formulation.alpha.
//
// A loop that locks only by a small angle d between its axes has an eigenvalue j of J inv(M) J' as small as d^2. Where
// alpha j is below 1, a refinement gains nearly nothing, and the loop gives way. The residual of the row does not show
// it, since the row is weak by d itself. Accelerations with a larger alpha show it, down to a few 1e-6 rad.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/mechanism/mechanism.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

// Change of the accelerations, relative to the largest, if alpha is 1e4 times as large; 0 for penalties, whose alpha is
// meant. worst_residual: of the run (Dynamics); where it is rounding, nothing is asked.
double error_of_weak_joints(const Mechanism& mechanism, const FormulationSettings& settings, double worst_residual,
                            double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
// Words for an error that makes accelerations so rough that a run crawls; empty for a smaller one.
std::string weak_joints_objection(double error);

}  // namespace mbsopt
