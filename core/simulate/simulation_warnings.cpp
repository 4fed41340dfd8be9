#include "core/simulate/simulation_warnings.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "core/cvodes/cvodes.hpp"

namespace mbsopt {
namespace {

// Violations of rows, lengths in units of the mechanism's. Projections leave 1e-11 and less, the rounding of
// coordinates up to 1e4 lengths. Where rows contradict each other, they give up below 1e-8 (projection_solution.hpp) at
// the first step.
constexpr double kApart = 1e-3;
constexpr double kContradicting = 1e-10;
constexpr double kUnmet = 1e-5;            // of the accelerations of the constraints
constexpr double kGivingWay = 1e-8;        // of the accelerations; gradients had errors of 500 times as much
constexpr double kTakenOut = 1e-4;         // by projections: those of the integration errors are of the order of rtol
constexpr double kEnergyLost = 1e-2;       // of the largest energy
constexpr double kUnresolved = 3e-2;       // of the integral of a running cost's size; estimates are pessimistic
constexpr double kUnresolvedPeaks = 0.3;   // of that of an exponential: the extreme errs by its logarithm/sharpness
constexpr double kWithinSteps = 100;       // tolerances: two of the requested digits
constexpr double kPulse = 1e-4;            // of velocities: what a pulse adds that fixed steps pass over
constexpr double kLargePenalty = 3e10;     // above it rounding by Cholesky passes 1e-5 of the accelerations
constexpr double kDigitsPerAlpha = 1e-16;  // docs/formulations.md, measured

using Warning = std::optional<std::string>;

bool is_penalty(const SimulationSettings& settings) { return settings.formulation.type == FormulationType::penalty; }
bool by_cvodes(const SimulationSettings& settings) { return is_cvodes(settings.integrator.type); }

Warning rounding_of_penalty(const SimulationSettings& settings) {
  const FormulationSettings& f = settings.formulation;
  if (!is_penalty(settings) || f.linear_solver != LinearSolver::cholesky || !(f.alpha > kLargePenalty)) return {};
  return fmt::format(
      "simulation.formulation: penalty with alpha {:.3g} by cholesky leaves the accelerations with relative errors of "
      "about {:.0e}, from rounding; \"linear_solver\": \"quasidefinite\" has none of them",
      f.alpha, 10 * kDigitsPerAlpha * f.alpha);
}

Warning joints_apart(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  if (!(statistics.relative_position_violation > kApart)) return {};
  const std::string advice =
      is_penalty(settings)
          ? fmt::format(
                "simulation.formulation.alpha is {:.3g}: raise it, it has to be large against the forces in "
                "the joints over the violation that is allowed; or leave the formulation out, the default has "
                "no such error",
                settings.formulation.alpha)
      : by_cvodes(settings) ? "Tighten rtol and atol, or take a Runge-Kutta method, which projects onto the constraints"
                            : "Tighten rtol and atol, or let simulation.formulation.projection be position_velocity";
  return fmt::format("the joints came apart: their equations are violated by up to {:.2g} [m, -]. {}",
                     statistics.max_position_violation, advice);
}

Warning energy_lost(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  if (!(statistics.relative_energy_drift > kEnergyLost && statistics.relative_position_violation <= kApart)) return {};
  return fmt::format(
      "the energy changed by up to {:.2g} J, {:.2g} % of all there is, although nothing does work: this is not the "
      "motion of the scene. {}{}",
      statistics.energy_drift, 100 * statistics.relative_energy_drift,
      settings.integrator.step ? "Take a smaller simulation.integrator.step"
                               : "Tighten simulation.integrator.rtol and atol",
      by_cvodes(settings) ? "; near singular positions a Runge-Kutta method, which projects onto the constraints, is "
                            "right where CVODES is not"
                          : "");
}

Warning accelerations_unmet(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  const double residual = statistics.max_acceleration_residual;
  if (is_penalty(settings)) {
    if (!(residual > kTakenOut)) return {};
    return fmt::format(
        "the projections took out {:.2g} of the change of velocity: the penalty does not hold the joints by itself, "
        "and the motion is wrong by as much or more. simulation.formulation.alpha is {:.3g}: raise it with "
        "\"linear_solver\": \"quasidefinite\", or leave the formulation out, the default has no such error{}",
        residual, settings.formulation.alpha,
        settings.integrator.step ? "; or take a smaller simulation.integrator.step" : "");
  }
  if (!(residual > kUnmet)) return {};
  return fmt::format(
      "the accelerations of the constraints were met to {:.1e} only: steps came close to a singular position, after "
      "which the branch may be wrong (compare with another Runge-Kutta method, or other tolerances), or masses differ "
      "too much for simulation.formulation (a larger alpha or more iterations), or joints lock only by a small angle "
      "between their axes and give way: raise simulation.formulation.alpha, or make the axes exactly parallel",
      residual);
}

Warning joints_give_way(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  if (!(statistics.weak_joints_error > kGivingWay)) return {};
  return fmt::format(
      "joints lock only by a small angle between their axes and give way: the accelerations have a relative error of "
      "{:.1e}, and gradients may have a thousand times as much. Make the axes exactly parallel, or raise "
      "simulation.formulation.alpha ({:.3g} now; 1e12 holds angles of 1e-6)",
      statistics.weak_joints_error, settings.formulation.alpha);
}

Warning contradicting_joints(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  const bool projects = settings.formulation.projection == Projection::position_velocity && !by_cvodes(settings);
  if (!projects || !(statistics.relative_position_violation > kContradicting)) return {};
  return fmt::format(
      "the equations of the joints contradict each other by {:.1e} [m, -], which no projection takes out: some of them "
      "nearly depend on each other, as where axes in a closed loop are parallel but for a few digits. Which motions "
      "they leave is uncertain, and so are the motion and its gradients, even in their first digits. Write these axes "
      "with all digits, or replace a joint of the loop by one with fewer equations (`validate` names joints with "
      "redundant equations)",
      statistics.max_position_violation);
}

// first: what to try before shorter steps, a sentence.
Warning unresolved(const SimulationSettings& settings, bool solved, const QuadratureError& worst, const char* what,
                   const char* consequence, double limit = kUnresolved, const char* first = "") {
  if (!(worst.error > limit) || worst.of.empty()) return {};
  constexpr const char* kCvodes = ", or take cvodes_bdf or cvodes_adams, which control this error";
  return fmt::format(
      "the steps do not resolve {} of objective '{}': {} has an estimated error of {:.2g} %, most of it near t = "
      "{:.6g} s. {}To resolve {}, {}{}",
      what, worst.of, consequence, 100 * worst.error, worst.time, first, what,
      solved                     ? "set simulation.integrator.max_step, or tighten rtol and atol"
      : settings.integrator.step ? "take a smaller simulation.integrator.step"
                                 : "set simulation.integrator.max_step, tighten rtol",
      solved ? "" : kCvodes);
}

Warning near_singular(const SimulationSettings& settings, const SimulationStatistics& statistics) {
  if (!(statistics.projected_error > kWithinSteps)) return {};
  return fmt::format(
      "near t = {:.6g} s the mechanism comes close to a singular position: states between the ends of steps there, as "
      "in rows of the trajectory and in sampled values, may be off by {:.1g} of their size. A smaller "
      "simulation.integrator.max_step helps",
      statistics.projected_error_time, statistics.projected_error * settings.integrator.rtol);
}

Warning missed_pulse(const Scene& scene, const SimulationStatistics& statistics) {
  const Pulse& pulse = statistics.pulse;
  if (!(pulse.error > kPulse)) return {};
  const auto signal = static_cast<std::size_t>(pulse.signal);
  const auto named = [](const char* kind, const auto& all, int k) {
    return fmt::format("{} '{}'", kind, all[static_cast<std::size_t>(k)].name);
  };
  const std::string what = pulse.force >= 0                ? named("the law of force", scene.forces, pulse.force)
                           : pulse.drive >= 0              ? named("the law of drive", scene.drives, pulse.drive)
                           : pulse.signal < 0              ? "a running cost"
                           : signal < scene.signals.size() ? named("signal", scene.signals, pulse.signal)
                                                           : "a table or spline of a law";
  return fmt::format(
      "the steps pass over a pulse of {} near t = {:.6g} s, which changes {} by {:.1g} of their size: {}", what,
      pulse.t, pulse.signal + pulse.force + pulse.drive < -2 ? "its integrals" : "velocities", pulse.error,
      scene.simulation.integrator.step ? "take a smaller simulation.integrator.step, or leave it out"
                                       : "set simulation.integrator.max_step to less than its duration");
}

}  // namespace

std::string in_words(const Scene& scene, const Jump& jump) {
  const std::size_t index = static_cast<std::size_t>(jump.index);
  const std::string what = jump.of == Jump::Owner::force ? "the law of force '" + scene.forces[index].name + "'"
                           : jump.of == Jump::Owner::drive
                               ? "the acceleration of drive '" + scene.drives[index].name + "'"
                               : "the integrand of objective '" + jump.objective + "'";
  std::string causes;
  for (const int k : jump.parameters)
    causes += (causes.empty() ? "'" : ", '") + scene.parameters[static_cast<std::size_t>(k)].name + "'";
  if (jump.motion) causes += causes.empty() ? "the motion, and so on the parameters" : " and the motion";
  if (jump.size == 0)
    return fmt::format("{} has a kink at t = {:.6g} s, an instant that depends on {}", what, jump.t, causes);
  return fmt::format(
      "{} jumps by {:.3g} at t = {:.6g} s, an instant that depends on {}: gradients leave out how it moves, so that "
      "they may be wrong, even 0. Let the value pass smoothly over a short time, by tanh(x/eps) or smooth_abs(x, eps)",
      what, jump.size, jump.t, causes);
}

std::vector<std::string> simulation_warnings(const Scene& scene, const SimulationSettings& settings,
                                             const SimulationStatistics& statistics, bool finished) {
  std::vector<std::string> warnings;
  const auto add = [&](std::optional<std::string> warning) {
    if (warning) warnings.push_back(std::move(*warning));
    return warning.has_value();
  };
  add(rounding_of_penalty(settings));
  add(joints_apart(settings, statistics));
  if (!finished) return warnings;
  // Each of these explains the ones after it, so only the first is reported.
  for (const auto& warning : {energy_lost, accelerations_unmet, joints_give_way, contradicting_joints})
    if (add(warning(settings, statistics))) break;
  add(unresolved(settings, statistics.solved, statistics.quadrature, "the running cost", "its integral"));
  add(unresolved(settings, statistics.solved, statistics.extreme_quadrature, "the peaks",
                 "the integral of their exponential", kUnresolvedPeaks,
                 "Give it less `sharpness`: some tens to hundreds, divided by the range of its values. "));
  add(unresolved(settings, statistics.solved, statistics.gradient_quadrature, "the derivative of the integrand",
                 "the gradient"));
  add(near_singular(settings, statistics));
  std::vector<std::string> parameters;
  for (const Parameter& p : scene.parameters) parameters.push_back(p.name);
  if (std::string words = in_words(statistics.singular, parameters); !words.empty()) warnings.push_back(words);
  add(missed_pulse(scene, statistics));
  if (statistics.grazing)
    warnings.push_back(
        fmt::format("at t = {:.6g} s a contact or a switch of a law only touches its limit (grazing): the gradients "
                    "leave it out, and "
                    "there may be none. Change the parameters, or the end of the run",
                    *statistics.grazing));
  for (const Jump& jump : statistics.jumps)
    if (jump.size != 0) warnings.push_back(in_words(scene, jump));  // kinks: gradient_doubts.hpp
  return warnings;
}

}  // namespace mbsopt
