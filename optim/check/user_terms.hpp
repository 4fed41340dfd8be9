// Compares each derivative of forces, costs and laws written in C++ with differences of its own value, at states of a
// motion. It names the wrong one; gradients would only show that one is wrong.
//
//   Q of a force against K = -dQ/dq, C = -dQ/dv, Q_rho        g and terminal costs against their gradients in y and rho
//   L of a mass term against M = -dL/dz, L_q, L_v, L_rho      f of a drive's law against f', f'', f'''
//
// Directions in (q, v) are those of motions: p'p = 1, p'pdot = 0, to first order. A derivative may have any value in
// the others.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/objective/objective.hpp"

namespace mbsopt::inline optim {

// Returns one sentence for each wrong derivative, with its force, drive or objective.
std::vector<std::string> wrong_user_terms(const Scene& scene, const std::vector<Objective>& objectives,
                                          const std::vector<std::shared_ptr<const UserForce>>& user_forces,
                                          const std::function<bool(double t)>& progress = {});

}  // namespace mbsopt::inline optim
