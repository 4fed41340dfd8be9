// The settings of a simulation: formulation, projection, integrator, tolerances. Measurements chose the defaults
// (docs/formulations.md); a problem file needs none of the settings.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace mbsopt {

enum class FormulationType { penalty, augmented_lagrangian };
// The solver of the penalty equations: S = M + J' alpha J, which loses digits as alpha grows, or the quasi-definite
// system [M J'; J -1/alpha], which does not.
enum class LinearSolver { cholesky, quasidefinite };
enum class Projection { none, velocity, position_velocity };
// Six unknowns per body, or three if joints hold all bodies in a plane (planar_model.hpp). `automatic` is planar if
// possible.
enum class ModelChoice { automatic, planar, spatial };
enum class Model { spatial, planar };
// The motion of a mechanism whose drives leave no freedom. `kinematics` solves its positions at each instant, and
// dynamics integrates its equations of motion. `automatic` solves if possible (core/driven).
enum class Solve { automatic, kinematics, dynamics };

struct FormulationSettings {
  FormulationType type = FormulationType::augmented_lagrangian;
  double alpha = 1e8;        // augmented_lagrangian: relative to the inertia each constraint sees; penalty: absolute
  double xi = 1;             // damping ratio of the stabilisation
  double omega = 0;          // its frequency [1/s]; 0 with projection
  int iterations = 50;       // augmented Lagrangian: refinements after the first solve, at most (1 is usual)
  double tolerance = 1e-14;  // relative, on the constraints' accelerations
  Projection projection = Projection::position_velocity;
  LinearSolver linear_solver = LinearSolver::cholesky;  // penalty only

  static FormulationSettings penalty() {  // MBSVT's form
    return {FormulationType::penalty, 1e9, 1, 10, 0, 0, Projection::none};
  }
  bool operator==(const FormulationSettings&) const = default;
};

// Settings of step-size control and of Newton's method for experts. An absent value is the method's own. A value that
// the method does not use is an error (docs/integrators.md).
struct IntegratorOptions {
  std::optional<double> min_step;          // [s], > 0; a rejected step that would fall below it ends the run
  std::optional<double> newton_tolerance;  // part of the tolerance, in (0, 1); else sqrt(rtol), at most 0.01
  std::optional<long> newton_iterations;   // at most, per solution of the stages to the tolerance; > 0; else 10
  std::optional<double> factor_min;        // h_new / h is at least this, in (0, 1); else 0.2
  std::optional<double> factor_max;        // and at most this, at least 1.25; else 6
  std::optional<double> safety;            // factor of the step that the error allows, in (0, 1); else 0.9
  std::string controller;                  // I, PI, PID (step_control.hpp); empty: PI
  bool operator==(const IntegratorOptions&) const = default;
};

// A tolerance that differs between the kinds of components of the state, and between bodies. An absent kind has the
// smallest of the given tolerances. A named body has its own tolerance for all its components.
struct KindTolerances {
  std::optional<double> position, angle, velocity, rate;  // of r [m], p (half an angle), rdot [m/s], pdot [1/s]
  std::vector<std::pair<std::string, double>> bodies;
  bool operator==(const KindTolerances&) const = default;

  double smallest() const {
    double least = std::numeric_limits<double>::infinity();
    for (const std::optional<double>& kind : {position, angle, velocity, rate})
      least = std::min(least, kind.value_or(least));
    for (const auto& [name, tolerance] : bodies) least = std::min(least, tolerance);
    return least;
  }
};

struct IntegratorSettings {
  std::string type = "dopri5";                     // a name of tableaus.hpp
  double rtol = 1e-6, atol = 1e-8;                 // the smallest of a component
  std::optional<KindTolerances> rtol_of, atol_of;  // the others, in proportion (component_tolerances.hpp)
  std::optional<double> initial_step, max_step;
  std::optional<double> step;  // fixed step
  long max_steps = 10'000'000;
  IntegratorOptions options;

  bool operator==(const IntegratorSettings&) const = default;
};

struct SimulationSettings {
  double start_time = 0, end_time = 1;  // [s]
  std::optional<double> output_step;    // default: 200 rows
  double redundancy_tolerance = 1e-5;   // of lengths and [rad]: rounding of joints in loops (rounded_loops.hpp)
  ModelChoice model = ModelChoice::automatic;
  Solve solve = Solve::automatic;
  FormulationSettings formulation;
  IntegratorSettings integrator;
  // The wanted relative error of the objectives, or of the motion without objectives. While it is set, the integrator
  // must still be chosen for it (optim/tradeoff/accuracy.hpp), and nothing can be simulated.
  std::optional<double> accuracy;
  std::vector<double> events;        // times at which a step ends and the next begins [s]
  bool follows_kinks = true;         // steps end at kinks and jumps of the motion (core/event/)
  double adjoint_memory_mib = 1024;  // limit of the forward motion that an adjoint run keeps [MiB]
};

}  // namespace mbsopt
