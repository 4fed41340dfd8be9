// Objectives and their gradients at a point, by the cheapest or the requested method. It keeps the last point: a solver
// that asks for f and then for its gradient pays once.
//
//   Evaluator evaluator(problem.scene, objectives_of(problem), {"k1", "L01"});
//   const Evaluation e = evaluator.gradients(evaluator.start());
//   if (!e.ok) std::cerr << e.message;
//   e.psi(0), e.psi_rho(0, 1);   // the first objective, and its derivative in L01
//
// The evaluator of a problem with load cases has one for each of them. Threads compute the cases; results do not depend
// on their number.
//
//   Evaluator evaluator(problem, {"track", "peak"}, {"k1"}, {.threads = 2});
//   evaluator.gradients(rho).psi(2 * c + 1);   // peak in case c
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
#include "optim/objective/objective_run.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// tlm and adjoint are the derivatives of the computed numbers; CVODES has none of these and gives its own. With
// cvodes_*, CVODES computes the motion and its continuous sensitivities for any integrator of the scene (cvodes.hpp).
enum class GradientMethod { automatic, tlm, adjoint, cvodes_forward, cvodes_adjoint, differences };
// In this order: auto, tlm, adjoint, cvodes_forward, cvodes_adjoint, fd.
std::string_view to_string(GradientMethod method);

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

// In load cases: psi and its derivatives case by case, each with all objectives. ok holds if all cases are ok.
// Statistics are those of the first.
struct Evaluation {
  bool ok = false;
  std::string message;                                // why not, in words
  Eigen::VectorXd rho;                                // all parameters
  Eigen::VectorXd psi;                                // per objective
  Eigen::MatrixXd psi_rho;                            // objective x variable; 0 x 0 if only values were requested
  std::vector<ExtremePiece> pieces;                   // with true_extremes and gradients; the most extreme ones first
  Eigen::MatrixXd curvature;                          // of gather_curvature(), where it was at hand
  GradientMethod method = GradientMethod::automatic;  // the one used; automatic where no simulation was needed
  std::string choice;                                 // why, in words, where there is something to say
  std::vector<std::string> warnings;                  // sentences on doubts about these numbers
  SimulationStatistics statistics;
  StepSequence steps;
  Eigen::VectorXd y_initial;
  long simulations = 0;  // number for this evaluation
  double wall_seconds = 0;
  std::vector<Evaluation> of_cases;  // empty where the problem has no load cases
  const Evaluation& of_case(std::size_t c) const { return of_cases.empty() ? *this : of_cases[c]; }
  bool has_gradients() const { return psi_rho.size() > 0; }
};

struct EvaluatorOptions {
  GradientMethod method = GradientMethod::automatic;
  DifferenceSettings differences = {};
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  std::function<bool(double t)> progress = {};  // after accepted steps; false abandons the evaluation
  bool exact_stages = true;                     // of values(), as in RunOptions: those of gradients() always are
  int threads = 1;                              // that compute load cases
  bool true_extremes = false;                   // in place of smooth ones; not in values_on() and gradients_on()
};

class Evaluator {
 public:
  // variables are names of parameters for derivatives; an empty list means all. Throws std::invalid_argument for a
  // variable that nothing uses, unless its allow_unused is set. gradients() shows the variables that costs and forces
  // in C++ use. The first call fails if all derivatives of such a variable are exactly 0; later calls warn.
  Evaluator(Scene scene, std::vector<Objective> objectives, const std::vector<std::string>& variables = {},
            EvaluatorOptions options = {});
  // The named objectives in all load cases. A problem without cases is its own only case. Each case is reduced to the
  // needs of its objectives. Forces written in C++ prevent this, because they name bodies by number.
  Evaluator(const Problem& problem, const std::vector<std::string>& objectives,
            const std::vector<std::string>& variables, const EvaluatorOptions& options = {});

  Evaluation values(const Eigen::VectorXd& rho);
  Evaluation gradients(const Eigen::VectorXd& rho);

  // The true largest or smallest value of each objective that is a smooth maximum or minimum, on a run of its own.
  // Other objectives have none. None has one if the run fails.
  std::vector<std::optional<double>> true_values(const Eigen::VectorXd& rho) const;

  // Evaluates on given steps, unless they end at events, which move, and leaves the stored point unchanged: values, and
  // discrete gradients by tlm or adjoint. CVODES cannot take given steps and throws std::invalid_argument. Not in load
  // cases.
  Evaluation values_on(const StepSequence& steps, const Eigen::VectorXd& rho) const;
  Evaluation gradients_on(const StepSequence& steps, const Eigen::VectorXd& rho, GradientMethod method) const;

  // From now on gradients come with the Gauss-Newton matrix of the first objective where a forward sweep gives them. It
  // does if nothing else was asked for, except with true extremes, whose instants are not known before.
  void gather_curvature();

  // The poses of the last evaluation, which is at rho, become the guess of the next ones if the drives determine them:
  // the mechanism stays in its assembly mode, also where the scene's own guess would lead to another one.
  void follow(const Eigen::VectorXd& rho);
  // Whether the scene's own guess leads to other poses at rho.
  bool has_left_guess(const Eigen::VectorXd& rho) const;

  // The same objectives and variables of another scene, such as one with other tolerances.
  Evaluator in(Scene scene, GradientMethod method) const;
  // The mechanism at rho, with derivatives in the variables or without any.
  Mechanism mechanism(const Eigen::VectorXd& rho, bool derivatives) const;

  std::size_t cases() const { return cases_.empty() ? 1 : cases_.size(); }
  Evaluator& of_case(std::size_t c) { return cases_.empty() ? *this : cases_[c]; }
  const Evaluator& of_case(std::size_t c) const { return cases_.empty() ? *this : cases_[c]; }
  std::string case_name(std::size_t c) const { return problem_ ? problem_->cases[c].name : std::string(); }
  std::string in_case(std::size_t c, const std::string& what) const;  // "what (cold)", with the problem's names
  // Calls work(c) in up to options().threads threads. The case with most right-hand sides in the last evaluation is
  // first.
  void for_each_case(const std::function<void(std::size_t c)>& work) const;

  // Scene and objectives are those of the first case.
  const Scene& scene() const { return scene_; }
  const EvaluatorOptions& options() const { return options_; }
  const std::vector<Objective>& objectives() const { return objectives_; }
  const std::vector<int>& variables() const { return variables_; }  // indices of parameters
  const Parameter& variable(Eigen::Index k) const;
  Eigen::VectorXd sizes(const Eigen::VectorXd& rho) const;  // typical_size of each variable
  Eigen::VectorXd start() const;                            // the parameters' values in the scene
  long simulations() const;                                 // since construction

 private:
  enum class Sweep { none, forward, backward };
  Evaluator(const Problem& problem, std::vector<Evaluator> cases);
  std::vector<bool> active(bool derivatives) const;  // parameters
  Evaluation in_cases(const Eigen::VectorXd& rho, Evaluation (Evaluator::*evaluate)(const Eigen::VectorXd&));
  Evaluation run(const Eigen::VectorXd& rho, Sweep sweep, const StepSequence* frozen, bool by_cvodes = false) const;
  // Parts of run(). They return false if the point cannot be evaluated; e.message then gives the reason.
  bool has_finite_parameters(Evaluation& e) const;
  bool add_simulated(Evaluation& e, Sweep sweep, const StepSequence* frozen, bool by_cvodes) const;
  SimulationResult smooth_run(Evaluation& e, Sweep sweep, const SimulationSettings& settings, const RunOptions& options,
                              bool gathers) const;
  SimulationResult extreme_run(Evaluation& e, Sweep sweep, const SimulationSettings& settings,
                               const RunOptions& options) const;
  bool add_parameters_only(Evaluation& e) const;
  bool has_finite_objectives(Evaluation& e) const;
  bool is_last(const Eigen::VectorXd& rho) const;
  std::size_t gradients_per_run() const;
  bool may_freeze(const StepSequence& steps) const { return simulated_ > 0 && steps.events.empty(); }
  GradientMethod chosen_method(std::string& choice) const;
  void add_differences(Evaluation& e) const;
  void find_unused();
  void judge_zero_columns(Evaluation& e) const;

  Scene scene_;
  std::vector<Objective> objectives_;
  std::vector<int> variables_;
  EvaluatorOptions options_;
  std::shared_ptr<ScenePrograms> programs_;
  std::shared_ptr<const Scene> given_;       // with its own guess, where another one is followed
  std::size_t simulated_ = 0;                // objectives that need a simulation
  std::vector<std::size_t> perhaps_unused_;  // variables that only what is written in C++ may use
  bool has_differentiated_ = false;          // gradients() has succeeded: no loop is a structure that cannot move
  Evaluation last_;
  bool gathers_curvature_ = false;
  long simulations_ = 0;
  std::shared_ptr<const Problem> problem_;  // with load cases; else null
  std::vector<Evaluator> cases_;            // one for each
};

// Whether the guesses of two scenes, alike in all else, lead to different poses at rho. No, if the other does not
// close.
bool lead_to_other_poses(const Scene& own, const Scene& other, const Eigen::VectorXd& rho,
                         const std::vector<std::shared_ptr<const UserForce>>& forces);

}  // namespace mbsopt::inline optim
