// Limits of extremes that hold for the true values. An optimiser sees smooth extremes (objective_kinds.hpp), which
// differ from the true ones. So the bound b on the smooth value moves, and the program is solved again from the last
// solution. This ends when the true extreme X keeps its limit U and uses what it allows:
//
//   b <- psi + (U - X)/s      psi: the smooth value at the solution,  s: slope dX/dpsi between the last two; 1 at first
//
// A barrier, or a tolerance on the product of multiplier and slack, leaves psi inside a bound of a small multiplier. If
// the multiplier says that the limit binds, and all limits hold, further rounds hold psi = b. If the multiplier changes
// its sign there, the limit does not bind, and its bound is an inequality again. Each case has its own limits.
//
//   TrueLimits limits(program);
//   do solve(program); while (limits.move(program, psi, evaluator.true_values(rho), sides));
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "optim/design/design_program.hpp"

namespace mbsopt::inline optim {

// Tolerance of an equality relative to its size; inequalities hold exactly.
inline constexpr double kTrueLimitTolerance = 1e-6;

class TrueLimits {
 public:
  explicit TrueLimits(const DesignProgram& program);

  // Gives the program new bounds, and returns true, if true values break limits at the solution, or leave them unused.
  // Returns false if there is nothing to move, or if bounds were moved often enough. c: the program's constraints at
  // the solution. sides: per constraint 1 if its upper bound holds the objective back, -1 if the lower one does, else
  // 0.
  bool move(DesignProgram& program, const Eigen::VectorXd& c, const std::vector<std::optional<double>>& true_values,
            const Eigen::VectorXi& sides);

  // Returns whether the true values keep the limits, used or not.
  bool hold(const DesignProgram& program, const std::vector<std::optional<double>>& true_values) const;
  // Gives the program the bounds of these limits, all inequalities.
  void set_inequalities(DesignProgram& program) const;

  int rounds() const { return rounds_; }  // in which bounds were moved
  // dX/dpsi of a constraint along the solutions; 1 where it is no extreme.
  double slope(Eigen::Index constraint) const;

 private:
  struct Limit {
    Eigen::Index constraint;
    std::optional<double> lower, upper;                // as the problem gives them
    double size;                                       // of these
    std::optional<double> smooth_lower, smooth_upper;  // what the program holds
    std::optional<double> psi = {}, X = {};            // of the round before
    double slope = 1;                                  // dX/dpsi
    int held = 0;                                      // side whose bound is an equality
    bool may_be_held = true;
  };
  static bool is_kept(const Limit& limit, double X);
  static bool is_settled(const Limit& limit, double psi, double X, int side);
  static void set_bounds(const Limit& limit, int held, DesignProgram& program);
  static void learn(Limit& limit, double psi, double X);
  static void move(Limit& limit, double psi, double X);

  std::vector<Limit> limits_;
  int rounds_ = 0;
};

}  // namespace mbsopt::inline optim
