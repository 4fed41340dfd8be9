// The options of a run beside its costs, and its result: objectives, gradients, statistics, figures behind warnings.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/run/cost.hpp"
#include "core/start/singular_window.hpp"

namespace mbsopt {

// A switch that passes from one side to another where a step ends (core/event/switches.hpp). That of a limit stays on
// its side: an impact.
struct SwitchEvent {
  std::size_t step = 0, of = 0;  // the indices of the step and of the switch
  int before = 0, after = 0;     // its sides
};

// An impact at a limit.
struct ImpactEvent {
  std::string name;              // of the limit
  double time = 0, impulse = 0;  // [s], [N s] or [N m s]
};

// Accepted steps: times.size() == sizes.size(); step i goes from times[i] by sizes[i].
struct StepSequence {
  std::vector<double> times, sizes;
  bool to_the_end = true;             // the last step is the run's last, not one before it
  std::vector<int> sides{};           // of all switches at the start
  std::vector<SwitchEvent> events{};  // in their order

  void add(double t, double h) {
    times.push_back(t);
    sizes.push_back(h);
  }
};

// The estimated error of an integral relative to the integral of |integrand|, with the objective and the time of most
// of it.
struct QuadratureError {
  double error = 0;
  std::string of;
  double time = 0;  // [s]
};

// A law, component of a force or running cost that jumps at an instant which parameters move (jump_watch.hpp).
struct Jump {
  enum class Owner { force, drive, objective };  // of a drive: its law's second derivative
  Owner of = Owner::force;
  int index = 0;                  // of the force or drive in the scene
  std::string objective{};        // its name
  double size = 0, t = 0;         // [unit of the law, s]
  std::vector<int> parameters{};  // active ones that the instant depends on directly
  bool motion = false;            // and whether it depends on the motion
};

// A pulse of a function of time that a step passes over (pulse_watch.hpp).
struct Pulse {
  int signal = -1, force = -1,
      drive = -1;           // the index in the scene of one of them; of none: a table, or a running cost
  double t = 0, error = 0;  // error: of the velocities, or of the cost, relative
};

struct SimulationStatistics {
  bool solved =
      false;  // drives leave nothing free: positions were solved, steps are panels of quadrature (core/driven)
  // rhs_evaluations counts those of the equations of motion, with each stage of a Newton iteration. jacobians counts
  // those of the same equations.
  long steps = 0, rejected = 0, rhs_evaluations = 0, factorisations = 0, jacobians = 0;
  // newton_iterations counts those of Newton's method. `linear_solves` counts the linear systems of these, of the error
  // filter, and of explicit equations of motion, without refinements.
  long newton_iterations = 0, linear_solves = 0;
  // The rejected steps by reason; their sum is `rejected`. placed_again: see singular_passage.hpp.
  struct Rejections {
    long error_test = 0, not_converged = 0, off_constraints = 0, not_finite = 0, placed_again = 0;
  } rejections;
  // factor_blocks counts the blocks of the explicit equations' factor (6 x 6, or 3 x 3 in the plane), diagonal ones
  // included. `linearised_states` counts the states at which derivatives of these equations were evaluated.
  long factor_blocks = 0, linearised_states = 0;
  std::vector<ImpactEvent> impacts;
  std::optional<double> grazing;  // the instant of an event without a derivative [s]; in runs with derivatives
  long kinks = 0;                 // at which steps ended: laws and costs passed from one branch to another
  double wall_seconds = 0;
  double max_position_violation = 0;                              // of |Phi| over accepted steps [m, -]
  double relative_position_violation = 0;                         // the same, lengths in units of the mechanism's
  double max_velocity_violation = 0;                              // of |Phi_q v + Phi_t|
  double energy_initial = 0, energy_final = 0, energy_drift = 0;  // drift: largest |E - E(0)| over accepted steps [J]
  double relative_energy_drift = 0;      // of the largest energy so far, if nothing does work; else 0
  double max_acceleration_residual = 0;  // relative, of the constraints' accelerations; penalty: of projections
  double weak_joints_error = 0;          // relative, of the accelerations at the end (weak_joints.hpp)
  std::size_t adjoint_memory_bytes = 0;  // the most that the backward sweep kept of the forward run
  long recomputed_steps = 0;             // for want of memory, of the backward sweep
  // For explicit methods with a stiffness test (stiffness.hpp): the steps tested, those at the edge of stability among
  // them, and the fastest rate |lambda| there [1/s].
  long watched_steps = 0, stability_limited_steps = 0;
  double stiffest_rate = 0;
  // The worst resolved running cost, exponential of a smooth extreme, and derivative of either (quadrature_watch.hpp).
  // They are 0 with CVODES, which controls this error.
  QuadratureError quadrature, extreme_quadrature, gradient_quadrature;
  std::vector<Jump> jumps;                 // in runs with derivatives
  std::vector<SingularPosition> singular;  // of solved runs: those asked for
  Pulse pulse;                             // the worst that the steps do not resolve
  // The largest error of a step near a singular position that its projection removed, in tolerances, and its time [s].
  // States within such steps are not projected.
  double projected_error = 0, projected_error_time = 0;
};

enum class SimulationStatus {
  ok,
  assembly_failed,
  step_too_small,
  step_too_large,
  too_many_steps,
  not_finite,
  not_solved,    // the stages of an implicit step
  not_credible,  // run_guard.hpp
  stopped
};

struct SimulationResult {
  SimulationStatus status = SimulationStatus::ok;
  std::string message;        // in words, with t, h and what to try; empty where ok
  double last_good_time = 0;  // [s]
  Eigen::VectorXd psi;        // per cost
  Eigen::MatrixXd psi_rho;    // cost x parameter; TLM and adjoint only
  // Adjoint only: d psi/dy at the start in any direction of y, cost x 14n (MBSVT's Lambda at the start). It is empty if
  // drives leave no freedom.
  Eigen::MatrixXd psi_y_initial;
  Eigen::VectorXd y_initial, y_end;
  SimulationStatistics statistics;
  StepSequence steps;
  bool ok() const { return status == SimulationStatus::ok; }
  void stop(SimulationStatus why, std::string words) {
    status = why;
    message = std::move(words);
  }
};

// An accepted step, with its states.
struct StepInside {
  double t0, t1;
  std::span<const double> solved;                       // ascending: the instants in it that a solved run knows
  const std::function<StatePoint(double t)>& state_at;  // valid until the next call
};

// Observes states at given times (ascending, within the simulated span) through dense output. It never forces a step.
struct Sampling {
  std::vector<double> times;
  std::function<void(std::size_t index, const StatePoint& at)> observe;
  std::function<void(const StepInside&)> look_inside = {};  // called after each accepted step; may be empty
};
// The same with derivatives: y_rho is dy/drho at that time, 14n x P. at.ydot is set.
struct TangentSampling {
  std::vector<double> times;
  std::function<void(std::size_t index, const StatePoint& at, const Eigen::MatrixXd& y_rho)> observe;
  bool reads_positions = false;  // and nothing else of the state: solved runs may omit the rest
};

struct RunOptions {
  const StepSequence* frozen = nullptr;    // take exactly these steps
  std::function<bool(double t)> progress;  // called after accepted steps; false stops the run (status: stopped)
  // Receives the state after each accepted step, but not the start. Use Sampling for states at given times.
  std::function<void(const StatePoint& at)> after_step = {};
  // Solves the stages of implicit methods to 1e-12 of the state, not to a fraction of the tolerance. The values then
  // compare with those of runs with derivatives, which always do so. Fixed and given steps solve them to rounding.
  bool exact_stages = false;
};

}  // namespace mbsopt
