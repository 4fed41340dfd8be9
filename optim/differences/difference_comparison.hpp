// Before an optimisation: is the gradient the slope of the minimised function? The test takes one central difference
// per variable, with step-size control, and compares it with the exact derivatives. These omit instants at which
// something jumps, and peaks between two steps.
//
//   s = (f(h) - f(-h))/(2 h),  h = 1e-3 of the variable's size        f: groups of rows, an objective or all residuals
//   |s - f_rho| <= max(1e-2 of either, |f(h) - 2 f(0) + f(-h)|/(2 h), 1e-3 of the group's largest derivative)
//
// Each variable is multiplied by its size, and a group has the 2-norm. If the test fails, it is repeated at h/16, and
// then within ten times the integrator's error of f in s. Only then it warns.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt::inline optim {

struct ComparedVariable {
  std::string name;
  double size = 1;                            // of it, > 0
  double below = INFINITY, above = INFINITY;  // how far its bounds are
};
ComparedVariable compared_variable(const std::string& name, const Parameter& at);  // at its value

struct DifferenceComparison {
  using Variable = ComparedVariable;
  struct Group {
    std::string name;  // "objective 'track'"
    Eigen::Index first = 0, rows = 1;
  };
  std::vector<Variable> variables;
  std::vector<Group> groups;
  Eigen::VectorXd f;      // at the start
  Eigen::MatrixXd f_rho;  // and its derivatives
  // Returns f with one variable changed, or nullopt if it cannot be evaluated.
  std::function<std::optional<Eigen::VectorXd>(std::size_t variable, double h)> at;
  // Returns f with ten times tighter tolerances; the change is the integrator's error. Or nullopt if it is unknown.
  std::function<std::optional<Eigen::VectorXd>()> tighter;
  std::function<bool()> go_on = {};  // false: abandon the comparison
  // The number of threads that call `at`, `tighter` and `go_on`. Above 1 these functions must be thread-safe.
  int threads = 1;

  // Returns a sentence for each variable that disagrees or could not be compared.
  std::vector<std::string> warnings() const;
};

}  // namespace mbsopt::inline optim
