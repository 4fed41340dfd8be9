// Compiles a Scene to MechanismData. Throws SceneError with the place in the scene. Pass the programs of this scene, or
// null for new ones.
#pragma once

#include <memory>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

class ScenePrograms;

MechanismData compile(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                      std::vector<std::shared_ptr<const UserForce>> user_forces,
                      std::shared_ptr<ScenePrograms> programs = nullptr);

}  // namespace mbsopt
