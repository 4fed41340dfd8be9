// An objective that can be evaluated at any rho:
//
//   sum     psi(rho) = integral of running dt + terminal at the end time + sum of samples + parameters_only
//   mean    psi(rho) = x0 + N(I/T),   I = integral of M(x - x0) dt over the simulated time T (objective_kinds.hpp)
//           or the difference of two such means, its parts
//
// A simulation computes I, which `cost` describes (in a sum, psi without parameters_only). `of_integral` turns I into
// psi:
//
//   const Objective track(scene, spec);
//   const Mechanism mechanism(scene, rho);
//   const SimulationResult run = simulate(mechanism, scene.simulation, std::vector{track.cost(mechanism)});
//   const double psi = track.of_integral(run.psi(0)).value + track.parameters_only(rho);
//
// run_objectives (objective_run.hpp) does this for several objectives and finds x0.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/objective/followed_mode.hpp"
#include "optim/objective/free_instants.hpp"
#include "optim/objective/frequency_response.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// A mean in psi, with its factor. side is 1 for a maximum, -1 for a minimum, 0 for neither.
struct ObjectivePart {
  int side = 0;
  double factor = 1;
  double softness = 1;  // a factor of the sharpness, for extremes so sharp that the steps do not resolve them
};

class Objective {
 public:
  using Progress = std::function<bool(double t)>;  // as in RunOptions

  // Throws std::invalid_argument: "objectives.track.running: unknown name ...".
  Objective(const Scene& scene, const ObjectiveSpec& spec);
  // An objective written in C++. One part may be null, but not both (std::invalid_argument).
  Objective(std::string name, std::shared_ptr<const RunningCost> running, std::shared_ptr<const TerminalCost> terminal);

  const std::string& name() const { return name_; }
  bool needs_simulation() const;
  const MeanKind* mean() const { return mean_; }  // null: a sum
  Extreme extreme() const { return mean_ ? mean_->extreme : Extreme::none; }
  bool is_extreme() const { return extreme() != Extreme::none; }
  std::vector<ObjectivePart> parts() const;
  // Returns the cost of a part; absent parts stay absent. Throws the exceptions of instants_of().
  Cost cost(const Mechanism& mechanism, const ObjectivePart& part = {}, double x0 = 0,
            const Progress& progress = {}) const;
  Derivatives of_integral(double I, const ObjectivePart& part = {},
                          double x0 = 0) const;                           // its mean, without the factor
  Derivatives integrand(double x, const ObjectivePart& part = {}) const;  // M of objective_kinds.hpp
  // The expression x of a kind that is no sum; null if it is the constant 0.
  std::shared_ptr<const PointCost> expression(const Mechanism& mechanism) const;
  // The parts, for second derivatives. `running` is the integrand, or the expression x of a kind that is no sum.
  struct Sample {
    double time;
    CostExpression value;
    std::optional<std::size_t> point = {};  // its point in free_instants(), which gives the time
  };
  const std::optional<CostExpression>& running() const { return running_; }
  const std::optional<CostExpression>& terminal() const { return terminal_; }
  const std::vector<Sample>& samples() const { return samples_; }
  // The instants of these samples, in their order; free ones depend on the motion. Throws as FreeInstants::nearest().
  struct Instant {
    double time;
    std::optional<std::size_t> block;  // of free ones, FreeInstants::Instant
  };
  std::vector<Instant> instants_of(const std::vector<Sample>& samples, const Mechanism& mechanism,
                                   const Progress& progress = {}) const;
  const std::optional<FreeInstants>& free_instants() const { return free_instants_; }
  // Their sum of squares is psi if is_sum_of_squares(): only `track` contributes. They are in the order of time, except
  // for free ones.
  const std::vector<Sample>& residuals() const { return residuals_; }
  bool is_sum_of_squares() const;
  double exponent(const ObjectivePart& part) const {
    return part.side * part.softness * sharpness_;
  }                                                                // k of an extreme
  bool is_of_linear_motion() const { return mode_ || response_; }  // an eigenvalue, a frequency response
  bool is_written_in_cpp() const { return user_running_ || user_terminal_; }
  const ObjectiveSpec& spec() const { return spec_; }  // of one that is not
  // Returns whether it is a sum of parts whose second derivatives in parameters and sensors are 0.
  bool is_linear() const;

  // The part that depends on the parameters alone; it includes an eigenvalue and a response. With its gradient in these
  // variables, the largest amplitude of a response is the first of its peaks, the least frequency of all modes the
  // first of them; side() is that of such pieces. Errors are std::runtime_error.
  double parameters_only(const Eigen::VectorXd& rho, const FollowedMode::UserForces& forces = {}) const;
  std::vector<FrequencyResponse::Peak> parameters_only_gradients(const Eigen::VectorXd& rho,
                                                                 const FollowedMode::UserForces& forces,
                                                                 const std::vector<int>& variables,
                                                                 std::vector<std::string>* warnings = nullptr) const;
  int side() const { return mode_ ? -1 : 1; }
  void add_parameters_only_hessian(const Eigen::VectorXd& rho, const std::vector<int>& variables,
                                   Eigen::MatrixXd& H) const;

 private:
  void follow(const TrackTerm& term, const Scene& scene, const std::string& place);

  std::string name_;
  ObjectiveSpec spec_;
  const MeanKind* mean_ = nullptr;
  double sharpness_ = 1, duration_ = 1;
  std::optional<CostExpression> running_, terminal_;
  std::vector<Sample> samples_, residuals_;
  std::optional<FreeInstants> free_instants_;
  std::optional<Program> parameters_only_;
  std::shared_ptr<const FollowedMode> mode_;
  std::shared_ptr<const FrequencyResponse> response_;
  std::shared_ptr<const RunningCost> user_running_;
  std::shared_ptr<const TerminalCost> user_terminal_;
};

// Returns the named objectives of a problem, or all if names is empty. Throws std::invalid_argument for unknown names.
std::vector<Objective> objectives_of(const Problem& problem, const std::vector<std::string>& names = {});

}  // namespace mbsopt::inline optim
