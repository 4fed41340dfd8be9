#include "optim/solver/nlopt_methods.hpp"

#include <fmt/format.h>
#include <nlopt.h>

#include <algorithm>
#include <array>

namespace mbsopt {
namespace {

using enum ConstraintSupport;
constexpr bool kGradients = true, kGlobal = true, kRandom = true, kNo = false;

constexpr std::array kMethods{NloptMethod{"slsqp", NLOPT_LD_SLSQP, kGradients, kNo, kNo, all},
                              NloptMethod{"mma", NLOPT_LD_MMA, kGradients, kNo, kNo, inequalities},
                              NloptMethod{"ccsaq", NLOPT_LD_CCSAQ, kGradients, kNo, kNo, inequalities},
                              NloptMethod{"lbfgs", NLOPT_LD_LBFGS, kGradients, kNo, kNo, augmented_lagrangian},
                              NloptMethod{"bobyqa", NLOPT_LN_BOBYQA, kNo, kNo, kNo, augmented_lagrangian},
                              NloptMethod{"cobyla", NLOPT_LN_COBYLA, kNo, kNo, kNo, all},
                              NloptMethod{"sbplx", NLOPT_LN_SBPLX, kNo, kNo, kNo, augmented_lagrangian},
                              NloptMethod{"mlsl", NLOPT_G_MLSL, kGradients, kGlobal, kRandom, none},
                              NloptMethod{"direct", NLOPT_GN_DIRECT, kNo, kGlobal, kNo, none},
                              NloptMethod{"crs", NLOPT_GN_CRS2_LM, kNo, kGlobal, kRandom, none},
                              NloptMethod{"isres", NLOPT_GN_ISRES, kNo, kGlobal, kRandom, all},
                              NloptMethod{"esch", NLOPT_GN_ESCH, kNo, kGlobal, kRandom, none}};

}  // namespace

const NloptMethod* find_nlopt_method(std::string_view name) {
  const auto method =
      std::find_if(kMethods.begin(), kMethods.end(), [&](const NloptMethod& m) { return m.name == name; });
  return method == kMethods.end() ? nullptr : &*method;
}

std::string_view nlopt_method_names() {
  static const std::string names = [] {
    std::string all_names;
    for (const NloptMethod& m : kMethods) all_names += (all_names.empty() ? "" : " ") + std::string(m.name);
    return all_names;
  }();
  return names;
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
