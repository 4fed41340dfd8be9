// The methods of NLopt that a design may name, and what each can do.
//
//   slsqp    sequential quadratic programming (Kraft 1994)               gradients   all constraints
//   mma      moving asymptotes, globally convergent (Svanberg 2002)      gradients   inequalities
//   ccsaq    the same with quadratic approximations (Svanberg 2002)      gradients   inequalities
//   lbfgs    limited-memory BFGS (Luksan)                                gradients   by augmented Lagrangian
//   bobyqa   quadratic interpolation (Powell 2009)                       values      by augmented Lagrangian
//   cobyla   linear interpolation (Powell 1994)                          values      all constraints
//   sbplx    Nelder-Mead in subspaces (Rowan 1990)                       values      by augmented Lagrangian
//   mlsl     multi-level single-linkage with lbfgs (Rinnooy Kan 1987)    gradients   none      global, random
//   direct   dividing rectangles (Jones 1993)                            values      none      global
//   crs      controlled random search (Kaelo and Ali 2006)               values      none      global, random
//   isres    evolution with stochastic ranking (Runarsson and Yao 2005)  values      all       global, random
//   esch     evolutionary (da Silva Santos 2010)                         values      none      global, random
//
// The augmented Lagrangian is NLopt's (Birgin and Martinez 2008). Global methods need all bounds.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <string_view>

namespace mbsopt {

enum class ConstraintSupport { none, inequalities, all, augmented_lagrangian };

struct NloptMethod {
  std::string_view name;
  int algorithm;  // of nlopt_algorithm
  bool gradients, global, random;
  ConstraintSupport constraints;
};
const NloptMethod* find_nlopt_method(std::string_view name);  // nullptr: no such method
std::string_view nlopt_method_names();                        // "slsqp mma ..."

// Where none is given: 500 for local methods with gradients, 500 (n + 1) for those without, 1000 (n + 1) for global
// ones.
long default_max_evaluations(const NloptMethod& method, Eigen::Index variables);

struct NloptNeeds {
  std::size_t variables = 0;
  bool constraints = false, equalities = false;
};
// Why the method cannot solve such a problem, with what can; empty where it can.
std::string nlopt_refusal(const NloptMethod& method, const NloptNeeds& needs);

}  // namespace mbsopt
