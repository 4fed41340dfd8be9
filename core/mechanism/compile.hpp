// Scene -> MechanismData. Throws SceneError with the place in the scene.
#pragma once

#include <memory>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

MechanismData compile(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                      std::vector<std::shared_ptr<const UserForce>> user_forces);

}  // namespace mbsopt
