// Limits of extremes that hold for the true values. An optimiser sees smooth extremes (objective_kinds.hpp), which
// differ from the true ones. So the bound b on the smooth value moves, and the program is solved again from the last
// solution. This ends when the true extreme X keeps its limit U and uses what it allows:
//
//   b <- psi + (U - X)/s      psi: the smooth value at the solution,  s: slope dX/dpsi between the last two; 1 at first
//
// Each case has its own.
//
//   TrueLimits limits(spec, evaluator);
//   do solve(program); while (limits.move(program, psi, evaluator.true_values(rho)));
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "optim/design/design_program.hpp"
#include "optim/objective/case_evaluator.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// Tolerance of an equality relative to its size; inequalities hold exactly.
inline constexpr double kTrueLimitTolerance = 1e-6;

class TrueLimits {
 public:
  // The evaluator's objectives: the one that is minimised, then those that are bounded.
  TrueLimits(const DesignSpec& spec, const CaseEvaluator& evaluator);

  // c: of the program at the solution; true values: of the evaluator. False where the limits hold and are used, or
  // where the bounds were moved often enough; otherwise the program has new bounds.
  bool move(DesignProgram& program, const Eigen::VectorXd& c, const std::vector<std::optional<double>>& true_values);

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
  };
  static bool is_settled(const Limit& limit, double psi, double X);
  static void learn(Limit& limit, double psi, double X);
  static void move(Limit& limit, double psi, double X);

  std::vector<Limit> limits_;
  int rounds_ = 0;
};

}  // namespace mbsopt
