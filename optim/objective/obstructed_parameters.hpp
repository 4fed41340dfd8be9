// Parameters that cannot change by themselves, since the redundant equations of a loop would contradict each other: the
// length of one of three parallel cranks. The motion has no derivative with respect to them. This is an error, not a
// number, as for unused parameters (unused_parameters.hpp).
#pragma once

#include "core/mechanism/mechanism.hpp"

namespace mbsopt::inline optim {

// Throws std::invalid_argument with the names of the obstructed parameters among the active ones, at these values. A
// scene that cannot be assembled there has none.
void require_unobstructed(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                          const std::vector<std::shared_ptr<const UserForce>>& user_forces = {});

}  // namespace mbsopt::inline optim
