// The scene as a kinematic problem: initial.conditions hold at all times, not at the start only.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

// Conditions on angles, displacements, distances, Euler parameters and global coordinates of points become drives.
// Their law is value + rate (t - start_time) + acceleration (t - start_time)^2 / 2. So a user chooses the driven
// degrees of freedom. The returned scene has no conditions. issues receives conditions that cannot become drives.
Scene kinematic_scene(const Scene& scene, std::vector<SceneIssue>& issues);

}  // namespace mbsopt
