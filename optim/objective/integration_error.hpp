// The integrator's error in psi and its derivatives. It is their change by ten times tighter tolerances, or looser ones
// if those are out of reach. For derivatives it is at least rtol times them. It estimates the size and is no bound.
// Fixed steps do not jump from run to run: the error is then zero.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/objective/evaluator.hpp"

namespace mbsopt::inline optim {

struct IntegrationError {
  Eigen::VectorXd psi;      // per objective, >= 0
  Eigen::MatrixXd psi_rho;  // objective x variable, >= 0
  long simulations = 0;
};

// The scene with factor times the integration errors. It multiplies tolerances by factor, and max_step and step by
// factor^(1/order), since the error is O(h^order) if they choose the steps. `steps` is the number of steps of a run. If
// any steps give the exact motion, tolerances choose none, and integrals keep their errors. For factor < 1 no step is
// then longer than the mean of that run times factor^(1/order).
Scene with_errors_times(double factor, Scene scene, long steps = 0);

// The scene with ten times tighter tolerances, or looser ones; none if its steps are fixed.
std::optional<Scene> with_other_tolerances(Scene scene, long steps = 0);

// Estimates the error of an evaluation with gradients, by a method of the caller's choice.
IntegrationError integration_error(const Evaluator& evaluator, const Evaluation& at,
                                   GradientMethod method = GradientMethod::automatic);

// Returns whether the estimates of every run allow that a gradient is off by more than kResolved. The estimates are
// those of its integrals, and rtol times the motion's magnification of a change of parameters. The gradient of an rms
// divides by the rms: if the rms is hardly larger than the tolerances, the gradient may be all error. Joints that come
// apart (CVODES does not project) are a doubt, too.
bool may_be_unresolved(const Evaluator& evaluator, const Evaluation& gradients);

// Reports, in sentences, gradients that are off by more than kResolved of their largest entry. Each entry is multiplied
// by its parameter's size.
std::vector<std::string> unresolved_gradients(const Evaluator& evaluator, const Evaluation& gradients,
                                              const IntegrationError& error);

}  // namespace mbsopt::inline optim
