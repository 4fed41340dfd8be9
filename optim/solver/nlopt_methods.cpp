#include "optim/solver/nlopt_methods.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace mbsopt {
namespace {

// name, gradients, global, random, constraints
constexpr std::array kMethods{NloptMethod{"slsqp", true, false, false, ConstraintSupport::all},
                              NloptMethod{"mma", true, false, false, ConstraintSupport::inequalities},
                              NloptMethod{"ccsaq", true, false, false, ConstraintSupport::inequalities},
                              NloptMethod{"lbfgs", true, false, false, ConstraintSupport::augmented_lagrangian},
                              NloptMethod{"bobyqa", false, false, false, ConstraintSupport::augmented_lagrangian},
                              NloptMethod{"cobyla", false, false, false, ConstraintSupport::all},
                              NloptMethod{"sbplx", false, false, false, ConstraintSupport::augmented_lagrangian},
                              NloptMethod{"mlsl", true, true, true, ConstraintSupport::none},
                              NloptMethod{"direct", false, true, false, ConstraintSupport::none},
                              NloptMethod{"crs", false, true, true, ConstraintSupport::none},
                              NloptMethod{"isres", false, true, true, ConstraintSupport::all},
                              NloptMethod{"esch", false, true, true, ConstraintSupport::none}};

}  // namespace

const NloptMethod* find_nlopt_method(std::string_view name) {
  const auto method =
      std::find_if(kMethods.begin(), kMethods.end(), [&](const NloptMethod& m) { return m.name == name; });
  return method == kMethods.end() ? nullptr : &*method;
}

long default_max_evaluations(const NloptMethod& method, Eigen::Index variables) {
  if (method.global) return 1000 * (variables + 1);
  return method.gradients ? 500 : 500 * (variables + 1);
}

std::string nlopt_refusal(const NloptMethod& method, const NloptNeeds& needs) {
  if (needs.constraints && method.constraints == ConstraintSupport::none)
    return fmt::format(
        "'{}' takes no constraints; isres does among the global methods, and ipopt, slsqp or cobyla from "
        "several starts (multistart)",
        method.name);
  if (needs.equalities && method.constraints == ConstraintSupport::inequalities)
    return fmt::format(
        "'{}' takes no equality constraints (lower = upper); ipopt, slsqp, cobyla and isres do, and "
        "lbfgs, bobyqa and sbplx by an augmented Lagrangian",
        method.name);
  if (method.name == "bobyqa" && needs.variables < 2)
    return "'bobyqa' needs two variables or more; cobyla and sbplx take one";
  return {};
}

}  // namespace mbsopt
