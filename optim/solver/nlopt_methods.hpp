// The methods of NLopt for a design, and the abilities of each. The table in nlopt_methods.cpp is the only list.
//
// The augmented Lagrangian is NLopt's (Birgin and Martinez 2008). Global methods need all bounds.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>

namespace mbsopt::inline optim {

enum class ConstraintSupport { none, inequalities, all, augmented_lagrangian };

struct NloptMethod {
  std::string_view name;
  int algorithm;  // of nlopt_algorithm
  bool gradients, global, random;
  ConstraintSupport constraints;
  std::size_t least_variables = 1;
};
const NloptMethod* find_nlopt_method(std::string_view name);  // nullptr: no such method
std::string_view nlopt_method_names();                        // "slsqp mma ..."
std::string_view nlopt_methods_by_kind();                     // "local methods with gradients (slsqp, ...) and ..."

// Returns whether the method uses limited-memory BFGS.
bool keeps_pairs(const NloptMethod& method);

// The default is 500 for local methods with gradients, 500 (n + 1) for those without, and 1000 (n + 1) for global ones.
long default_max_evaluations(const NloptMethod& method, Eigen::Index variables);

struct NloptNeeds {
  std::size_t variables = 0;
  bool constraints = false, equalities = false;
};
// The reason why the method cannot solve such a problem, with methods that can; empty if it can.
std::string nlopt_refusal(const NloptMethod& method, const NloptNeeds& needs);

}  // namespace mbsopt::inline optim
