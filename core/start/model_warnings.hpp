// Sentences on oddities of a mechanism at its assembled start. Such scenes run, but are seldom intended.
//
//   massless directions that no joint holds        (M is singular on the null space of J: no acceleration there)
//   springs of zero length                         (they have no direction)
//   gravity normal to the plane of the mechanism   (it moves nothing)
//   a static equilibrium that is unstable
//   rounding of the derivatives of the start       (lengths far from 1 m)
//   a guess that violates joints by much           (the assembled state may be another than the one that was meant)
#pragma once

#include <string>
#include <vector>

#include "core/start/assembly.hpp"

namespace mbsopt {

std::vector<std::string> model_warnings(const Mechanism& mechanism, const Assembly& assembly);
// The bodies with massless directions, counted from 1; none if the assembly failed.
std::vector<int> massless_bodies(const Mechanism& mechanism, const Assembly& assembly);
// The same at an assembled state.
std::vector<int> massless_bodies(const MechanismData& data, const Eigen::VectorXd& y);
// The first two of these warnings, which can explain the end of a simulation.
std::vector<std::string> start_warnings(const Mechanism& mechanism, const Assembly& assembly);

}  // namespace mbsopt
