// Parameters without effect: nothing uses them, or nothing that uses them reaches an objective or measurement. Their
// gradient entries would be zero by structure. This is an error rather than a silent zero; "allow_unused" permits it.
//
// A parameter has an effect when it occurs
//   in an objective, or in sigma, gain or bias of a channel;
//   in a sensor that one of these uses;
//   in the model of the bodies that such a sensor observes, and of all bodies that joints, forces or initial conditions
//   connect with those (not through the ground): their fields, joints, forces and conditions, and gravity.
//
// energy, constraint_violation and smallest_singular_value observe all bodies. A problem without objectives and
// identification counts as if a sensor observed everything.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// The problem must have no other issues. whole: something else observes everything.
std::vector<SceneIssue> find_unused_parameters(const Problem& problem, bool whole = false);

// Sets allow_unused of parameters that only measurements or load cases use. Commands on the problem's own objectives
// then accept them.
void allow_what_only_measurements_use(Problem& problem);

// The problem as far as its objectives depend on it. It omits bodies that no objective observes and that nothing
// connects with an observed one (not through the ground). It also omits elements that act on or measure these. Such
// bodies then cost nothing in values and gradients. Parameters stay. The problem must have no other issues.
Problem what_objectives_need(const Problem& problem, std::vector<std::string>* left_out = nullptr);

// Likewise, the problem as far as its measurements depend on it.
Problem what_measurements_need(const Problem& problem, std::vector<std::string>* left_out = nullptr);

// Finds variables of a design without effect on the objectives that it minimises or bounds. Finds variables and free
// parameters of an identification without effect on its channels. They may affect other objectives of the problem.
std::vector<SceneIssue> find_idle_variables(const Problem& problem);

// The fields of a problem that each parameter enters, directly or through definitions.
struct ParameterUse {
  std::string parameter;
  std::vector<std::string> fields;  // paths in the file: "bodies[2].mass", "drives[0].law"
};
std::vector<ParameterUse> parameter_uses(const Problem& problem);

}  // namespace mbsopt::inline optim
