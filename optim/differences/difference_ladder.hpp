// Derivatives of functions that can only be evaluated: differences over a ladder of steps h0, h0/2, h0/4, ... and
// Richardson extrapolation of their errors to zero:
//
//   central     T_j0 = (f(h_j) - f(-h_j)) / (2 h_j)     errors h^2, h^4, ...     b = 4
//   one-sided   T_j0 = (f(h_j) - f(0)) / h_j            errors h, h^2, ...       b = 2
//   T_jk = T_j,k-1 + (T_j,k-1 - T_j-1,k-1) / (b^k - 1)
//
// Each component takes the entry with the least estimated error. The estimate is the entry's distance from its two
// sources, and the rounding of f (Ridders, Advances in Engineering Software 4 (1982) 75-76).
//
//   const auto f = [&](double h) { return std::optional(value_at(x + h)); };
//   const LadderDerivative d = difference_ladder(f, f0.size(), {1e-2 * x});
//   d.derivative(0), d.error(0);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <limits>
#include <optional>

namespace mbsopt::inline optim {

struct LadderDerivative {
  Eigen::VectorXd derivative;
  // The estimated error: infinite if no step could be evaluated, the largest double if only one could.
  Eigen::VectorXd error;
  Eigen::VectorXd rounding;  // the part of it that comes from the noise of f
  Eigen::VectorXd step;      // of the rung taken,
  Eigen::VectorXd largest;   // and of the first of those that it is extrapolated from
  int evaluations = 0;
  bool has_estimate(Eigen::Index i) const { return i < error.size() && error(i) < std::numeric_limits<double>::max(); }
  void take_better(const LadderDerivative& other);  // its components with less error
};

struct LadderOptions {
  double step = 1e-2;  // the largest, h0 > 0; one-sided also < 0
  int rungs = 8;       // >= 1
  double noise = 0;    // of f, relative to its largest value: 0 takes the rounding of a double
  // Called after each rung: true ends the ladder with this derivative. If it is absent, all rungs are evaluated.
  std::function<bool(const LadderDerivative& best)> enough = {};
};

// f at an offset, or nullopt if it cannot be evaluated; the ladder skips this rung.
using LadderFunction = std::function<std::optional<Eigen::VectorXd>(double h)>;

// size is that of f.
LadderDerivative difference_ladder(const LadderFunction& f, Eigen::Index size, const LadderOptions& options = {});

// Takes the side of the step's sign if the other side is out of reach. f0 = f(0). It is less exact: the extrapolation
// amplifies the noise of f up to 8.3 times, prod (2^k + 1)/(2^k - 1). The error includes this.
LadderDerivative one_sided_ladder(const LadderFunction& f, const Eigen::VectorXd& f0,
                                  const LadderOptions& options = {});

}  // namespace mbsopt::inline optim
