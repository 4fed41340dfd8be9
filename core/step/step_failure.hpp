// Why a run ends at a step, in words, with what to change.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"

namespace mbsopt {

struct MechanismData;

// unsolved: Newton's method did not converge; failed: a number is not finite, a matrix is singular; off_constraints:
// projection found no state that meets them.
enum class StepOutcome { accepted, rejected, unsolved, failed, off_constraints };

// Says why a run cannot begin without accelerations at its start.
std::string start_failure(const MechanismData& data, double t);
// Says why the step from t by h failed; adaptive: it was the last of smaller and smaller ones.
std::string step_failure(StepOutcome outcome, double t, double h, bool adaptive,
                         const FormulationSettings& formulation);
// what: "the accelerations", or derivatives of them.
std::string not_computable(const std::string& what, double t);
// A step of simulation.integrator.options.min_step is still too long.
std::string below_min_step(StepOutcome outcome, double t, double min_step);
// longest: of the steps so far.
std::string too_long_run(double span, double longest);
// Tolerances below the rounding errors of numbers.
std::string too_few_digits(const IntegratorSettings& settings, double t);
// Returns whether they are, for the state y, in the norm of the step-size control.
bool beyond_digits(const ComponentTolerances& tolerances, const Eigen::VectorXd& y);
// Where S = M + alpha J'J may have lost M to rounding: what to change, as the end of a message.
std::string about_alpha(const FormulationSettings& formulation);

}  // namespace mbsopt
