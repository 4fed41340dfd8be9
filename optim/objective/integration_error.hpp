// How much of psi and of its derivatives is the integrator's error: the change that ten times tighter tolerances make
// (looser ones where tighter are out of reach), of derivatives at least rtol times them. An estimate of its size, no
// bound. With fixed steps there is nothing that jumps from run to run: zero, unless it is asked for.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt {

class Objective;
struct UserForce;

struct IntegrationError {
  Eigen::VectorXd psi;      // per objective, >= 0
  Eigen::MatrixXd psi_rho;  // objective x parameter, >= 0
  long simulations = 0;
};

struct IntegrationErrorOptions {
  std::vector<std::shared_ptr<const UserForce>> user_forces = {};
  std::function<bool(double t)> progress = {};  // within a simulation; false abandons it
  GradientMethod method = GradientMethod::automatic;
  bool fixed_steps = false;  // estimate their error, too
  long steps = 0;            // of the run that gave psi and psi_rho
};

// The scene with factor times the integration errors: tolerances times factor, and max_step and step times
// factor^(1/order), since the error is O(h^order) where they choose the steps. steps: how many a run of the scene
// takes. Where the motion is met exactly by any steps, tolerances choose none, and integrals keep their errors; for
// factor < 1 no step is then longer than the mean of that run times factor^(1/order).
Scene with_errors_times(double factor, Scene scene, long steps = 0);

// The scene with tolerances ten times tighter, or looser; none where its steps are fixed.
std::optional<Scene> with_other_tolerances(Scene scene, long steps = 0);

// psi, psi_rho: at the parameters and tolerances of the scene.
IntegrationError integration_error(const Scene& scene, const std::vector<Objective>& objectives,
                                   const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                   const IntegrationErrorOptions& options = {});

// Whether the estimates that every run makes leave it possible that a gradient is off by more than kResolved: those of
// its integrals, and rtol times how much the motion magnifies a change of parameters. The gradient of an rms divides by
// the rms: one that is hardly larger than the tolerances may be all error.
bool may_be_unresolved(const Scene& scene, const std::vector<Objective>& objectives, const Evaluation& gradients);

// In sentences: the gradients that are off by more than kResolved of their largest entry, each entry times its
// parameter's size.
std::vector<std::string> unresolved_gradients(const Scene& scene, const std::vector<Objective>& objectives,
                                              const Eigen::VectorXd& psi, const Eigen::MatrixXd& psi_rho,
                                              const IntegrationError& error);

}  // namespace mbsopt
