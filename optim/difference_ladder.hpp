// Derivatives of functions that can only be evaluated: central differences over a ladder of steps h0, h0/2, h0/4, ...
// and Richardson extrapolation of their errors h^2, h^4, ... to zero:
//
//   T_j0 = (f(h_j) - f(-h_j)) / (2 h_j)          T_jk = T_j,k-1 + (T_j,k-1 - T_j-1,k-1) / (4^k - 1)
//
// Of each component the entry with the least estimated error is taken, estimated by its distance from the two it is
// made of and by the rounding of f (Ridders, Advances in Engineering Software 4 (1982) 75-76).
//
//   const auto f = [&](double h) { return std::optional(value_at(x + h)); };
//   const LadderDerivative d = difference_ladder(f, f0, {1e-2 * x});
//   d.derivative(0), d.error(0);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

namespace mbsopt {

struct LadderOptions {
  double step = 1e-2;  // the largest, h0 > 0
  int rungs = 8;       // >= 1
  double noise = 0;    // of f, relative to its largest value: 0 takes the rounding of a double
};

struct LadderDerivative {
  Eigen::VectorXd derivative;
  Eigen::VectorXd error;     // estimated; infinite where no step could be evaluated
  Eigen::VectorXd rounding;  // the part of it that comes from the noise of f
  Eigen::VectorXd step;      // of the rung taken
  int evaluations = 0;
};

// f(h): the function at an offset, nullopt where it cannot be evaluated (that rung is skipped). size: of f.
LadderDerivative difference_ladder(const std::function<std::optional<Eigen::VectorXd>(double h)>& f, Eigen::Index size,
                                   const LadderOptions& options = {});

}  // namespace mbsopt
