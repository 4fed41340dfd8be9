// Checks of the settings of a simulation that need more than one field (check_meaning in checker.hpp).
#include <algorithm>
#include <cmath>

#include "core/scene/checker.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

void check_meaning(Checker& checker, const IntegratorOptions& o) {
  const auto below_one = [&](std::string_view key, const std::optional<double>& value) {
    if (value && *value >= 1) checker.refuse(key, "is {}, it must be below 1", *value);
  };
  below_one("newton_tolerance", o.newton_tolerance);
  below_one("factor_min", o.factor_min);
  below_one("safety", o.safety);
  constexpr double kLeastGrowth = 1.25;  // implicit methods keep a step that would grow by less than 1.2
  if (o.factor_max && *o.factor_max < kLeastGrowth)
    checker.refuse("factor_max", "is {}: steps could hardly grow again; at least {} is allowed", *o.factor_max,
                   kLeastGrowth);
}

namespace {

constexpr double kMostRows = 1e7;  // of trajectory.csv, which has 2.5 GB then with one body alone

// Finds options that the method does not have.
void check_options(Checker& checker, const IntegratorSettings& settings) {
  const IntegratorOptions& o = settings.options;
  const std::string path = checker.path("options");
  const Method* const method = runge_kutta_method(settings.type);
  using Given = std::pair<std::string_view, bool>;
  const Given min_step[] = {{"min_step", o.min_step.has_value()}};
  const Given step_control[] = {{"factor_min", o.factor_min.has_value()},
                                {"factor_max", o.factor_max.has_value()},
                                {"safety", o.safety.has_value()},
                                {"controller", !o.controller.empty()}};
  const Given newton[] = {{"newton_tolerance", o.newton_tolerance.has_value()},
                          {"newton_iterations", o.newton_iterations.has_value()}};
  const auto refuse = [&](std::span<const Given> options, const std::string& reason) {
    for (const auto& [key, given] : options)
      if (given) checker.issue(child_path(path, key), filled("is given, but {}; leave it out", reason));
  };
  if (settings.step) {
    const std::string fixed = "the step is fixed (step)";
    refuse(min_step, fixed);
    refuse(step_control, fixed);
    return refuse(newton, fixed + ", and implicit stages are then solved to rounding");
  }
  if (has_word(kMultistepMethods, settings.type)) {
    refuse(step_control, settings.type + " chooses steps by rules of its own");
    if (settings.type == "cvodes_adams") refuse(newton, "cvodes_adams does not use Newton's method");
  } else if (method && !method->implicit()) {
    refuse(newton, settings.type + " is explicit and does not use Newton's method");
  } else if (method && method->gamma) {
    refuse(newton, filled("the stages of {} solve linear equations, without Newton's method", settings.type));
  }
  for (const auto& [key, step] : {std::pair{"initial_step", settings.initial_step}, {"max_step", settings.max_step}})
    if (o.min_step && step && *o.min_step > *step)
      checker.issue(child_path(path, "min_step"), filled("is {} s, above {}, {} s", *o.min_step, key, *step));
}

}  // namespace

void check_meaning(Checker& checker, const IntegratorSettings& settings) {
  check_options(checker, settings);
  const Method* const method = runge_kutta_method(settings.type);
  if (method && !method->adaptive && !settings.step)
    checker.refuse("step", "is missing; {} has no error estimate and needs a fixed step [s]", settings.type);
  if (has_word(kMultistepMethods, settings.type) && settings.step)
    checker.refuse("step", "is {}; {} chooses its own steps: leave it out and give rtol, atol or max_step",
                   *settings.step, settings.type);
  if (settings.initial_step && settings.max_step && *settings.initial_step > *settings.max_step)
    checker.refuse("initial_step", "is {}, above max_step {}", *settings.initial_step, *settings.max_step);
  const std::string path = checker.path("rtol");
  const auto relative = [&](const std::string& place, const std::optional<double>& rtol) {
    if (rtol && *rtol >= 1) checker.issue(place, filled("is {}, a relative tolerance must be below 1", *rtol));
  };
  if (const auto& kinds = settings.rtol_of) {
    relative(child_path(path, "position"), kinds->position);
    relative(child_path(path, "angle"), kinds->angle);
    relative(child_path(path, "velocity"), kinds->velocity);
    relative(child_path(path, "rate"), kinds->rate);
    for (const auto& [name, value] : kinds->bodies) relative(child_path(child_path(path, "bodies"), name), value);
  } else {
    relative(path, settings.rtol);
  }
}

void check_meaning(Checker& checker, const SimulationSettings& settings) {
  const double start = settings.start_time, end = settings.end_time, span = end - start;
  if (end <= start) checker.refuse("end_time", "is {} s, it must be after start_time, {} s", end, start);
  constexpr double kResolved = 1e-8;  // a step of a millionth of the span still has two digits
  if (span > 0 && span < kResolved * std::max(std::abs(start), std::abs(end)))
    checker.refuse("end_time",
                   "is {} s after start_time, {} s: numbers of that size do not resolve steps of so short a time; let "
                   "time begin near 0",
                   span, start);
  const IntegratorSettings& integrator = settings.integrator;
  if (integrator.step && span / *integrator.step > static_cast<double>(integrator.max_steps))
    checker.issue(child_path(checker.path("integrator"), "step"),
                  filled("is {} s: the run would need more steps than max_steps, {}, allows; take a longer step, or "
                         "raise max_steps",
                         *integrator.step, static_cast<double>(integrator.max_steps)));
  if (settings.output_step && span / *settings.output_step > kMostRows)
    checker.refuse("output_step",
                   "is {} s: more than {} rows of trajectory.csv; take a longer one, or an earlier end_time",
                   *settings.output_step, kMostRows);
  if (settings.accuracy && *settings.accuracy >= 1)
    checker.refuse("accuracy", "is {}, a relative error must be below 1", *settings.accuracy);
  if (!settings.events.empty() && has_word(kMultistepMethods, integrator.type))
    checker.refuse("events",
                   "are times at which a step ends; {} does not end steps there: leave them out, or take a Runge-Kutta "
                   "method",
                   integrator.type);
  for (std::size_t i = 0; i < settings.events.size(); ++i)
    if (const double event = settings.events[i]; !(event > start && event < end))
      checker.issue(child_path(checker.path("events"), i),
                    filled("is {} s, it must lie between start_time, {} s, and end_time, {} s", event, start, end));
}

}  // namespace mbsopt
