// A design as the nonlinear program that solvers see: scaled variables, constraints relative to the size of their
// bounds, case by case. The evaluation of the best point is kept, so that nothing is simulated again for the report.
//
//   DesignProgram program(spec, evaluator, scaling);
//   program.start_from(x_start);
//   solve_with_ipopt(program, x_start, options);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "optim/objective/case_evaluator.hpp"
#include "optim/objective/case_objective.hpp"
#include "optim/problem/problem.hpp"
#include "optim/problem/variable_scaling.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

class DesignProgram : public NonlinearProgram {
 public:
  // The evaluator's objectives: the one that is minimised, then those that are bounded. abandoned: whether the user
  // stopped an evaluation that failed.
  DesignProgram(const DesignSpec& spec, CaseEvaluator& evaluator, const VariableScaling& scaling,
                CaseObjective objective = {}, std::function<bool()> abandoned = {});

  // Evaluates the start and scales by it. The scale gives the objective a size and a gradient of about 1: the larger of
  // those at the start and a little way from it. So a start at the optimum, where both may vanish, is recognised.
  // Constraints likewise. Or by a given scale.
  CaseEvaluation start_from(const Eigen::VectorXd& x_start, const std::optional<NlpScale>& scale = {});

  Eigen::VectorXd rho_at(const Eigen::VectorXd& x) const;  // all parameters

  void evaluate(const Eigen::VectorXd& x, NlpPoint& point) override;
  void evaluate_values(const Eigen::VectorXd& x, NlpPoint& point) override;
  bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override;

  // The evaluation with gradients at rho: the one that was kept, or a new one.
  CaseEvaluation evaluation(const Eigen::VectorXd& rho);

  // psi_of: index of a constraint's objective in an evaluation. minimised: the values that are minimised, one of each
  // case.
  Eigen::Index psi_of(Eigen::Index constraint) const;
  Eigen::VectorXd minimised(const Eigen::VectorXd& psi) const;
  const CaseObjective& objective() const { return objective_; }
  const VariableScaling& scaling() const { return scaling_; }
  double size(Eigen::Index constraint) const { return size_(constraint); }
  // Other bounds for the objective of a constraint; the best point is judged by them from now on.
  void set_bounds(Eigen::Index constraint, const std::optional<double>& lower, const std::optional<double>& upper);
  long hessian_gradients() const { return hessian_gradients_; }            // that second derivatives took
  const std::string& hessian_failure() const { return hessian_failure_; }  // the first, in words

 private:
  NlpScale scale_at(const Eigen::VectorXd& x_start);
  bool second_derivatives(const Eigen::VectorXd& rho, std::vector<Eigen::MatrixXd>& psi_rhorho);
  void fill(const CaseEvaluation& e, const Eigen::VectorXd& x, NlpPoint& point) const;
  void keep(const CaseEvaluation& e);
  double violations_of(const Evaluation& e) const;
  Eigen::Index row_of(std::size_t load_case) const;  // in an evaluation, of the objective that is minimised
  Eigen::VectorXd f_rho(const Evaluation& e) const;

  CaseEvaluator& evaluator_;
  const CaseObjective objective_;
  const Eigen::Index bounds_;  // of each case
  const VariableScaling& scaling_;
  const std::function<bool()> abandoned_;
  const Eigen::VectorXd rho_;  // the scene's values, which parameters that are not designed keep
  Eigen::VectorXd size_;       // of each constraint's bounds
  CaseEvaluation best_;
  double best_f_ = 0, best_violations_ = 0;
  long hessian_gradients_ = 0;
  std::string hessian_failure_;
  const bool gauss_newton_;
};

inline constexpr double kConstraintTolerance = 1e-8;  // relative to the size of the bounds: what counts as held

}  // namespace mbsopt::inline optim
