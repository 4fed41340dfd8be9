// Parameters that cannot matter: nothing uses them, or what uses them cannot reach any objective or measurement, so
// that their gradient entries would be zero by structure. An error rather than a silent zero; "allow_unused" lifts it.
//
// A parameter matters when it occurs
//   in an objective, or in sigma, gain or bias of a channel;
//   in a sensor that one of these uses;
//   in the model of the bodies that such a sensor looks at, and of all bodies that joints, forces or initial conditions
//   connect with those (not through the ground): their fields, joints, forces and conditions, and gravity.
// energy, constraint_violation and smallest_singular_value look at all bodies. A problem without objectives and
// identification is judged as if a sensor looked at everything.
#pragma once

#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// For a problem without other issues.
std::vector<SceneIssue> find_unused_parameters(const Problem& problem);

// Sets allow_unused of parameters that matter to measurements or load cases alone: commands that look at the objectives
// of the problem itself let them be.
void allow_what_only_measurements_use(Problem& problem);

// The problem as far as its objectives depend on it: without the bodies that none of them looks at and that nothing
// connects with one that is looked at (not through the ground), and without what acts on or measures these. Such bodies
// then cost nothing in values and gradients. Parameters stay as they are. For a problem without other issues.
Problem what_objectives_need(const Problem& problem, std::vector<std::string>* left_out = nullptr);

// Likewise, the problem as far as its measurements depend on it.
Problem what_measurements_need(const Problem& problem, std::vector<std::string>* left_out = nullptr);

// Variables of a design that matter to none of the objectives it minimises or bounds, and variables and free parameters
// of an identification that matter to none of its channels, though they may matter to other objectives of the problem.
std::vector<SceneIssue> find_idle_variables(const Problem& problem);

}  // namespace mbsopt
