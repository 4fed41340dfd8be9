// The scene as a kinematic problem: what initial.conditions prescribe at the start is prescribed at all times.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

// Conditions on angles, displacements, distances, Euler parameters and global coordinates of points become drives of
// the law value + rate (t - start_time) + acceleration (t - start_time)^2 / 2; the degrees of freedom that no drive
// holds are chosen so. The scene returned has no conditions left. Issues: conditions that cannot become drives.
Scene kinematic_scene(const Scene& scene, std::vector<SceneIssue>& issues);

}  // namespace mbsopt
