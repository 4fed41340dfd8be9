// Before an optimisation: is the gradient that it will follow the slope of what it minimises? One central difference
// per variable, with step-size control at work, against the exact derivatives, which know nothing of instants at which
// something jumps or of peaks between two steps.
//
//   s = (f(h) - f(-h))/(2 h),  h = 1e-3 of the variable's size        f: groups of rows, an objective or all residuals
//   |s - f_rho| <= max(1e-2 of either, |f(h) - 2 f(0) + f(-h)|/(2 h), 1e-3 of the group's largest derivative)
//
// each variable times its size, in the 2-norm of a group. Where that does not hold, it is asked again at h/16, and
// last within ten times the integrator's error, before anything is said.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt {

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
  // f with one variable moved; nullopt where it cannot be evaluated.
  std::function<std::optional<Eigen::VectorXd>(std::size_t variable, double h)> at;
  // f and its derivatives with ten times tighter tolerances (what differs is the integrator's error); false: not known.
  std::function<bool(Eigen::VectorXd& f, Eigen::MatrixXd& f_rho)> tighter;
  std::function<bool()> go_on = {};  // false: abandon the comparison
  // So many threads call `at`, `tighter` and `go_on` at a time. Above 1 these functions have to be thread-safe.
  int threads = 1;

  // Returns a sentence for each variable that disagrees or could not be compared.
  std::vector<std::string> warnings() const;
};

}  // namespace mbsopt
