// Costs written in C++ that a problem names. They read the state of some bodies and parameters of their own. The chain
// rule leads back to the state y and the parameters rho of the scene.
//
//   g(t, y_b, p),  y_b: rows of y of the bodies,  p = p(rho)        g_rho = g_p dp/drho
#pragma once

#include <memory>
#include <string>

#include "core/run/cost.hpp"
#include "core/scene/scene.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

struct BoundCosts {
  std::shared_ptr<const RunningCost> running;    // null where there is none
  std::shared_ptr<const TerminalCost> terminal;  // null where there is none
};

// place is that of the spec in the problem, for messages. Throws std::invalid_argument for unknown names and for costs
// that nothing provides.
BoundCosts bound_costs(const Scene& scene, const UserCostSpec& spec, const std::string& place);

}  // namespace mbsopt::inline optim
