// Objectives and their gradients at a point, by the cheapest or the requested method. It keeps the last point: a solver
// that asks for f and then for its gradient pays once.
//
//   Evaluator evaluator(problem.scene, objectives_of(problem), {"k1", "L01"});
//   const Evaluation e = evaluator.gradients(evaluator.start());
//   if (!e.ok) std::cerr << e.message;
//   e.psi(0), e.psi_rho(0, 1);   // the first objective, and its derivative in L01
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/simulate/simulation.hpp"
#include "optim/objective/objective.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

// tlm and adjoint are the derivatives of the computed numbers; CVODES has none of these and gives its own. With
// cvodes_*, CVODES computes the motion and its continuous sensitivities for any integrator of the scene (cvodes.hpp).
enum class GradientMethod { automatic, tlm, adjoint, cvodes_forward, cvodes_adjoint, differences };
std::string_view to_string(GradientMethod method);  // auto, tlm, adjoint, cvodes_forward, cvodes_adjoint, fd

struct DifferenceSettings {
  double relative_step = 4e-3;  // the largest: of the parameter's value, or of 1 where that is 0
  int rungs = 4;                // steps, each half of the one before
  // Differences use the steps of the run at the point itself, else step-size control. CVODES always uses step-size
  // control.
  bool frozen_steps = true;
};

// Estimated cost in simulations, from which `automatic` chooses. The figures are measured
// (docs/design-optimisation.md).
//   tlm        1.5 + 2.2 per block of four variables, which go through a step together
//   adjoint    1.7 + 0.9 per objective
struct GradientCost {
  double tlm = 0, adjoint = 0;
};
GradientCost gradient_cost(std::size_t variables, std::size_t objectives);

struct Evaluation {
  bool ok = false;
  std::string message;                                // why not, in words
  Eigen::VectorXd rho;                                // all parameters
  Eigen::VectorXd psi;                                // per objective
  Eigen::MatrixXd psi_rho;                            // objective x variable; 0 x 0 if only values were requested
  GradientMethod method = GradientMethod::automatic;  // the one used; automatic where no simulation was needed
  std::string choice;                                 // why, in words, where there is something to say
  std::vector<std::string> warnings;                  // sentences on doubts about these numbers
  SimulationStatistics statistics;
  StepSequence steps;
  long simulations = 0;  // number for this evaluation
  double wall_seconds = 0;
  bool has_gradients() const { return psi_rho.size() > 0; }
};

struct EvaluatorOptions {
  GradientMethod method = GradientMethod::automatic;
  DifferenceSettings differences;
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  std::function<bool(double t)> progress;  // after accepted steps; false abandons the evaluation
  bool exact_stages = true;                // of values(), as in RunOptions: those of gradients() always are
};

class Evaluator {
 public:
  // variables are names of parameters for derivatives; an empty list means all. Throws std::invalid_argument for a
  // variable that nothing uses, unless its allow_unused is set. gradients() shows the variables that costs and forces
  // in C++ use. The first call fails if all derivatives of such a variable are exactly 0; later calls warn.
  Evaluator(Scene scene, std::vector<Objective> objectives, const std::vector<std::string>& variables = {},
            EvaluatorOptions options = {});

  Evaluation values(const Eigen::VectorXd& rho);
  Evaluation gradients(const Eigen::VectorXd& rho);

  // The true largest or smallest value of each objective that is a smooth maximum or minimum, on a run of its own.
  // Other objectives have none. None has one if the run fails.
  std::vector<std::optional<double>> true_values(const Eigen::VectorXd& rho) const;

  // Evaluates on given steps and leaves the stored point unchanged: values, and discrete gradients by tlm or adjoint.
  // CVODES cannot take given steps and throws std::invalid_argument.
  Evaluation values_on(const StepSequence& steps, const Eigen::VectorXd& rho) const;
  Evaluation gradients_on(const StepSequence& steps, const Eigen::VectorXd& rho, GradientMethod method) const;

  const Scene& scene() const { return scene_; }
  const EvaluatorOptions& options() const { return options_; }
  const std::shared_ptr<ScenePrograms>& programs() const { return programs_; }  // of the scene
  const std::vector<Objective>& objectives() const { return objectives_; }
  const std::vector<int>& variables() const { return variables_; }  // indices of parameters
  Eigen::VectorXd start() const;                                    // the parameters' values in the scene
  long simulations() const { return simulations_; }                 // since construction

 private:
  enum class Sweep { none, forward, backward };
  Evaluation run(const Eigen::VectorXd& rho, Sweep sweep, const StepSequence* frozen, bool by_cvodes = false) const;
  GradientMethod available(GradientMethod method, std::string& choice) const;
  // Parts of run(). They return false if the point cannot be evaluated; e.message then gives the reason.
  bool has_finite_parameters(Evaluation& e) const;
  bool add_simulated(Evaluation& e, Sweep sweep, const StepSequence* frozen, bool by_cvodes) const;
  bool add_parameters_only(Evaluation& e, bool gradients) const;
  bool has_finite_objectives(Evaluation& e) const;
  void take(const SimulationResult& result, bool warn, Evaluation& e) const;
  void add_differences(Evaluation& e) const;
  void find_unused();
  void judge_zero_columns(Evaluation& e) const;
  std::vector<const Objective*> simulated() const;

  Scene scene_;
  std::vector<Objective> objectives_;
  std::vector<int> variables_;
  std::vector<bool> active_;
  EvaluatorOptions options_;
  std::shared_ptr<ScenePrograms> programs_;
  std::vector<std::size_t> simulated_;       // objectives that need a simulation
  std::vector<std::size_t> perhaps_unused_;  // variables that only what is written in C++ may use
  bool has_differentiated_ = false;          // gradients() has succeeded: no loop is a structure that cannot move
  Evaluation last_;
  long simulations_ = 0;
};

}  // namespace mbsopt::inline optim
