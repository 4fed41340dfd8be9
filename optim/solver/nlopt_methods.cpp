#include "optim/solver/nlopt_methods.hpp"

#include <fmt/format.h>
#include <nlopt.h>

#include <algorithm>

namespace mbsopt::inline optim {
namespace {

using enum ConstraintSupport;
constexpr bool kGradients = true, kGlobal = true, kRandom = true, kNo = false;

// clang-format off
constexpr NloptMethod kMethods[] = {
    {"slsqp", NLOPT_LD_SLSQP, kGradients, kNo, kNo, all},              // sequential quadratic programming: Kraft 1994
    {"mma", NLOPT_LD_MMA, kGradients, kNo, kNo, inequalities},         // moving asymptotes: Svanberg 2002
    {"ccsaq", NLOPT_LD_CCSAQ, kGradients, kNo, kNo, inequalities},     // the same, quadratic approximations
    {"lbfgs", NLOPT_LD_LBFGS, kGradients, kNo, kNo, augmented_lagrangian},  // limited-memory BFGS: Luksan
    {"bobyqa", NLOPT_LN_BOBYQA, kNo, kNo, kNo, augmented_lagrangian, 2},    // quadratic interpolation: Powell 2009
    {"cobyla", NLOPT_LN_COBYLA, kNo, kNo, kNo, all},                   // linear interpolation: Powell 1994
    {"sbplx", NLOPT_LN_SBPLX, kNo, kNo, kNo, augmented_lagrangian},    // Nelder-Mead in subspaces: Rowan 1990
    {"mlsl", NLOPT_G_MLSL, kGradients, kGlobal, kRandom, none},        // single-linkage with lbfgs: Rinnooy Kan 1987
    {"direct", NLOPT_GN_DIRECT, kNo, kGlobal, kNo, none},              // dividing rectangles: Jones 1993
    {"crs", NLOPT_GN_CRS2_LM, kNo, kGlobal, kRandom, none},            // controlled random search: Kaelo and Ali 2006
    {"isres", NLOPT_GN_ISRES, kNo, kGlobal, kRandom, all},             // stochastic ranking: Runarsson and Yao 2005
    {"esch", NLOPT_GN_ESCH, kNo, kGlobal, kRandom, none}};             // evolutionary: da Silva Santos 2010
// clang-format on

template <class Wanted>
std::string names_of(std::string_view separator, const Wanted& wanted) {
  std::string names;
  for (const NloptMethod& m : kMethods)
    if (wanted(m)) names.append(names.empty() ? "" : separator).append(m.name);
  return names;
}

}  // namespace

const NloptMethod* find_nlopt_method(std::string_view name) {
  const auto method = std::ranges::find(kMethods, name, &NloptMethod::name);
  return method == std::end(kMethods) ? nullptr : &*method;
}

std::string_view nlopt_method_names() {
  static const std::string names = names_of(" ", [](const NloptMethod&) { return true; });
  return names;
}

std::string_view nlopt_methods_by_kind() {
  static const std::string kinds =
      fmt::format("local methods with gradients ({}) and without ({}), and global ones ({})",
                  names_of(", ", [](const NloptMethod& m) { return !m.global && m.gradients; }),
                  names_of(", ", [](const NloptMethod& m) { return !m.global && !m.gradients; }),
                  names_of(", ", [](const NloptMethod& m) { return m.global; }));
  return kinds;
}

bool keeps_pairs(const NloptMethod& method) {
  return method.algorithm == NLOPT_LD_LBFGS || method.algorithm == NLOPT_G_MLSL;  // mlsl: its local searches
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
  if (needs.variables < method.least_variables)
    return fmt::format("'{}' needs two variables or more; cobyla and sbplx take one", method.name);
  return {};
}

}  // namespace mbsopt::inline optim
