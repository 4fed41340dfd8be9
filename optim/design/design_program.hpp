// A design as the nonlinear program that solvers see: scaled variables, constraints relative to the size of their
// bounds, case by case. It owns what all searches of a design share: the checked problem, the evaluator, the scaling
// and the start. The evaluation of the best point is kept, so that nothing is simulated again for the report.
//
//   DesignProgram program(problem, options);
//   program.start_from(program.x_start());
//   solve_with_ipopt(program, program.x_start(), solver_options);
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/design/design_result.hpp"
#include "optim/objective/case_objective.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/variable_scaling.hpp"
#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::inline optim {

class DesignProgram : public NonlinearProgram {
 public:
  // The evaluator's objectives are the one that is minimised, then those that are bounded. Throws std::invalid_argument
  // if problem.design makes no sense. options.simulation_progress is that of each simulation. abandoned: whether the
  // user stopped an evaluation that failed.
  explicit DesignProgram(const Problem& problem, const DesignOptions& options = {},
                         std::function<bool()> abandoned = {});

  // Evaluates the start and scales by it. The scale gives the objective a size and a gradient of about 1: the larger of
  // those at the start and a little way from it. So a start at the optimum, where both may vanish, is recognised.
  // Constraints likewise. Or by a given scale.
  Evaluation start_from(const Eigen::VectorXd& x_start, const std::optional<NlpScale>& scale = {});
  const NlpScale& scale() const { return scale_; }  // as given or found by start_from()

  void evaluate(const Eigen::VectorXd& x, NlpPoint& point) override;
  void evaluate_values(const Eigen::VectorXd& x, NlpPoint& point) override;
  bool hessians(const Eigen::VectorXd& x, std::vector<Eigen::MatrixXd>& H) override;
  void moved_to(const Eigen::VectorXd& x) override { evaluator_.follow(rho_at(x)); }
  // Whether hessians() are Gauss-Newton's, of the objective alone, because it is a sum over squares or the like.
  bool has_squares() const { return has_squares_; }

  // The evaluation with gradients at rho: the one that was kept, or a new one.
  Evaluation evaluation(const Eigen::VectorXd& rho);

  const Problem& problem() const { return problem_; }
  std::vector<Parameter> designed() const;          // the variables, by their names in the problem
  const DesignSpec& spec() const { return spec_; }  // with the sharpness of the maximum over cases
  Evaluator& evaluator() { return evaluator_; }
  const Evaluator& evaluator() const { return evaluator_; }
  const VariableScaling& scaling() const { return scaling_; }
  const Eigen::VectorXd& x_start() const { return x_start_; }
  const CaseObjective& objective() const { return objective_; }
  Eigen::VectorXd rho_at(const Eigen::VectorXd& x) const;  // all parameters

  // The objective of a constraint, its bounds in the problem, their size, and its index in an evaluation.
  const Objective& limited(Eigen::Index constraint) const;
  const ObjectiveBound& bound(Eigen::Index constraint) const;
  double size(Eigen::Index constraint) const { return size_(constraint); }
  Eigen::Index psi_of(Eigen::Index constraint) const;
  // The values that are minimised: those of all terms in each case, and their rows in an evaluation.
  Eigen::VectorXd minimised(const Eigen::VectorXd& psi) const;
  std::vector<Eigen::Index> minimised_rows() const;
  long hessian_gradients() const { return hessian_gradients_; }            // that second derivatives took
  const std::string& hessian_failure() const { return hessian_failure_; }  // the first, in words

 private:
  Eigen::VectorXd felt_changes();
  std::optional<double> sharpness();
  NlpScale scale_at(const Eigen::VectorXd& x_start);
  bool second_derivatives(const Evaluation& at, std::vector<Eigen::MatrixXd>& psi_rhorho);
  void fill(const Evaluation& e, const Eigen::VectorXd& x, NlpPoint& point);
  void add_pieces(const Evaluation& e, const Eigen::VectorXd& rho_x, NlpPoint& point) const;
  double violations_of(const Evaluation& e) const;
  Eigen::VectorXd f_rho(const Evaluation& e) const;

  const Problem problem_;
  DesignSpec spec_;
  Evaluator evaluator_;
  const VariableScaling scaling_;
  const Eigen::VectorXd x_start_;
  CaseObjective objective_;
  const Eigen::Index terms_, bounds_;  // of each case
  const std::function<bool()> abandoned_;
  NlpScale scale_;
  Eigen::VectorXd size_;  // of each constraint's bounds
  Evaluation best_;
  double best_f_ = 0, best_violations_ = 0;
  long hessian_gradients_ = 0;
  std::string hessian_failure_;
  const bool has_squares_, gauss_newton_;
};

std::vector<std::string> objective_names(
    const DesignSpec& spec);  // the terms of what is minimised, then what is bounded

inline constexpr double kConstraintTolerance = 1e-8;  // relative to the size of the bounds: what counts as held

}  // namespace mbsopt::inline optim
