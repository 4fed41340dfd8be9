#include "core/step/step_failure.hpp"

#include <fmt/format.h>

#include <limits>

#include "core/linear/dense.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/step/step_control.hpp"

namespace mbsopt {
namespace {

std::string bodies_without_inertia(const MechanismData& d) {
  std::string names;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& b = d.bodies[static_cast<std::size_t>(i)];
    const double least = symmetric_eigenvalues(b.J)(0);
    if (b.mass > 0 && least > 0) continue;
    names += (names.empty() ? "'" : ", '") + d.body_names[static_cast<std::size_t>(i)] + "'";
  }
  return names;
}

}  // namespace

std::string start_failure(const MechanismData& data, double t) {
  const std::string bodies = bodies_without_inertia(data);
  return fmt::format("the accelerations at the start, t = {:.6g} s, cannot be computed. ", t) +
         (bodies.empty()
              ? "A force or law is not finite there (a root, logarithm or division outside its range?): look "
                "at the laws of forces and drives and at the sensors in them"
              : "A body without mass or inertia in a direction that no joint holds has none: " + bodies +
                    ". Give it some, or hold it");
}

std::string about_alpha(const FormulationSettings& f) {
  constexpr double kLarge = 1e13;
  const bool keeps_digits = f.type == FormulationType::penalty && f.linear_solver == LinearSolver::quasidefinite;
  if (keeps_digits || f.alpha < kLarge) return {};
  return fmt::format(". Or simulation.formulation.alpha is too large: {:.3g}, where 1e8 is usual", f.alpha);
}

std::string not_computable(const std::string& what, double t) {
  return fmt::format(
      "{} cannot be computed beyond t = {:.6g} s, however small the step. Look for a law or force that is not finite "
      "there (a root, logarithm or division outside its range), or a body without inertia in a direction that no joint "
      "holds",
      what, t);
}

std::string too_long_run(double span, double longest) {
  return fmt::format(
      "a run of {:.3g} s is too long for this motion, whose steps were {:.3g} s at most: double precision could no "
      "longer resolve the time. Is simulation.end_time in seconds?",
      span, longest);
}

std::string below_min_step(StepOutcome outcome, double t, double min_step) {
  const char* const reason = outcome == StepOutcome::rejected          ? "its error is too large"
                             : outcome == StepOutcome::unsolved        ? "Newton's method did not converge"
                             : outcome == StepOutcome::off_constraints ? "no position and velocity meet the constraints"
                                                                       : "the accelerations cannot be computed";
  return fmt::format(
      "at t = {:.6g} s the step would fall below simulation.integrator.options.min_step, {:.3g} s: {}. Make min_step "
      "smaller or leave it out, or loosen rtol and atol",
      t, min_step, reason);
}

std::string too_few_digits(const IntegratorSettings& settings, double t) {
  return fmt::format("rtol {:.3g} and atol {:.3g} ask for more digits at t = {:.6g} s than numbers have: loosen them",
                     settings.rtol, settings.atol, t);
}

bool beyond_digits(const ComponentTolerances& tolerances, const Eigen::VectorXd& y) {
  return !(std::numeric_limits<double>::epsilon() * scaled_norm(y, y, y, tolerances) <= 1);
}

std::string step_failure(StepOutcome outcome, double t, double h, bool adaptive,
                         const FormulationSettings& formulation) {
  switch (outcome) {
    case StepOutcome::unsolved:
      return fmt::format(
          "the stages of the implicit step from t = {:.6g} s by {:.3g} s were not found: Newton's method did "
          "not converge. {} for a law that is not smooth or not finite, a singular position, or a drive that asks for "
          "more than the mechanism reaches, near this time",
          t, h, adaptive ? "Look" : "Use a smaller step, or look");
    case StepOutcome::off_constraints:
      return adaptive
                 ? fmt::format(
                       "no position and velocity beyond t = {:.6g} s meet the constraints, however small the step. "
                       "Does a drive ask for more than the mechanism reaches, or is the position singular? Look at the "
                       "laws of drives and the lengths",
                       t)
                 : fmt::format(
                       "after the step from t = {:.6g} s by {:.3g} s no position and velocity nearby meet the "
                       "constraints. The step is too large for this motion, or a drive asks for more than the "
                       "mechanism "
                       "reaches: use a smaller step, or an adaptive integrator (no \"step\")",
                       t, h);
    case StepOutcome::failed:
      return (adaptive
                  ? not_computable("the accelerations", t)
                  : fmt::format("the state stopped being finite in the step from t = {:.6g} s by {:.3g} s. The step is "
                                "too large "
                                "for this motion: use a smaller step, or an adaptive integrator (no \"step\")",
                                t, h)) +
             about_alpha(formulation);
    default:
      return fmt::format(
          "the step fell to {:.3g} s at t = {:.6g} s and its error is still too large. Look for a "
          "singular position, a drive that asks for more than the mechanism reaches, a spring of zero length or a law "
          "that is not smooth near this time; "
          "looser tolerances or a fixed step may pass it",
          h, t);
  }
}

}  // namespace mbsopt
