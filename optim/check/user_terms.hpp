// Forces, costs and laws written in C++, each derivative against differences of its own value at states of a motion:
// which one is wrong, where all gradients only say that one is.
//
//   Q of a force against K = -dQ/dq, C = -dQ/dv, Q_rho        g and terminal costs against their gradients in y and rho
//   L of a mass term against M = -dL/dz, L_q, L_v, L_rho      f of a drive's law against f', f'', f'''
//
// Directions in (q, v) are such that the state moves: p'p = 1, p'pdot = 0, to first order. A derivative may say what it
// likes in the others.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/objective/objective.hpp"

namespace mbsopt {

struct UserForce;

// One sentence for each derivative that is wrong, by its force, drive or objective.
std::vector<std::string> wrong_user_terms(const Scene& scene, const std::vector<Objective>& objectives,
                                          const std::vector<std::shared_ptr<const UserForce>>& user_forces,
                                          const std::function<bool(double t)>& progress = {});

}  // namespace mbsopt
