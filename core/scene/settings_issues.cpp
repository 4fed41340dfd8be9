// Checks of the settings of a simulation that need more than one field (check_meaning in checker.hpp).
#include <algorithm>
#include <cmath>

#include "core/scene/checker.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

void check_meaning(Checker& checker, const IntegratorOptions& o) {
  const auto below_one = [&](std::string_view key, const std::optional<double>& value) {
    if (value && *value >= 1) checker.issue(checker.path(key), "is " + text_of(*value) + ", it must be below 1");
  };
  below_one("newton_tolerance", o.newton_tolerance);
  below_one("factor_min", o.factor_min);
  below_one("safety", o.safety);
  constexpr double kLeastGrowth = 1.25;  // implicit methods keep a step that would grow by less than 1.2
  if (o.factor_max && *o.factor_max < kLeastGrowth)
    checker.issue(checker.path("factor_max"), "is " + text_of(*o.factor_max) +
                                                  ": steps could hardly grow again; at least " + text_of(kLeastGrowth) +
                                                  " is allowed");
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
      if (given) checker.issue(child_path(path, key), "is given, but " + reason + "; leave it out");
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
    refuse(newton, "the stages of " + settings.type + " solve linear equations, without Newton's method");
  }
  for (const auto& [key, step] : {std::pair{"initial_step", settings.initial_step}, {"max_step", settings.max_step}}) {
    if (o.min_step && step && *o.min_step > *step)
      checker.issue(child_path(path, "min_step"),
                    "is " + text_of(*o.min_step) + " s, above " + key + ", " + text_of(*step) + " s");
  }
}

}  // namespace

void check_meaning(Checker& checker, const IntegratorSettings& settings) {
  check_options(checker, settings);
  const Method* const method = runge_kutta_method(settings.type);
  if (method && !method->adaptive && !settings.step)
    checker.issue(checker.path("step"),
                  "is missing; " + settings.type + " has no error estimate and needs a fixed step [s]");
  if (has_word(kMultistepMethods, settings.type) && settings.step)
    checker.issue(checker.path("step"), "is " + text_of(*settings.step) + "; " + settings.type +
                                            " chooses its own steps: leave it out and give rtol, atol or max_step");
  if (settings.initial_step && settings.max_step && *settings.initial_step > *settings.max_step)
    checker.issue(checker.path("initial_step"),
                  "is " + text_of(*settings.initial_step) + ", above max_step " + text_of(*settings.max_step));
  const auto relative = [&](const std::string& path, const std::optional<double>& rtol) {
    if (rtol && *rtol >= 1) checker.issue(path, "is " + text_of(*rtol) + ", a relative tolerance must be below 1");
  };
  const std::string rtol = checker.path("rtol");
  if (const auto& kinds = settings.rtol_of) {
    relative(child_path(rtol, "position"), kinds->position);
    relative(child_path(rtol, "angle"), kinds->angle);
    relative(child_path(rtol, "velocity"), kinds->velocity);
    relative(child_path(rtol, "rate"), kinds->rate);
    for (const auto& [name, value] : kinds->bodies) relative(child_path(child_path(rtol, "bodies"), name), value);
  } else {
    relative(rtol, settings.rtol);
  }
}

void check_meaning(Checker& checker, const SimulationSettings& settings) {
  if (settings.end_time <= settings.start_time)
    checker.issue(checker.path("end_time"), "is " + text_of(settings.end_time) + " s, it must be after start_time, " +
                                                text_of(settings.start_time) + " s");
  const double span = settings.end_time - settings.start_time;
  constexpr double kResolved = 1e-8;  // a step of a millionth of the span still has two digits
  if (span > 0 && span < kResolved * std::max(std::abs(settings.start_time), std::abs(settings.end_time)))
    checker.issue(checker.path("end_time"), "is " + text_of(span) + " s after start_time, " +
                                                text_of(settings.start_time) +
                                                " s: numbers of that size do not resolve steps of so short a time; "
                                                "let time begin near 0");
  const IntegratorSettings& integrator = settings.integrator;
  if (integrator.step && span / *integrator.step > static_cast<double>(integrator.max_steps))
    checker.issue(child_path(checker.path("integrator"), "step"),
                  "is " + text_of(*integrator.step) + " s: the run would need more steps than max_steps, " +
                      text_of(static_cast<double>(integrator.max_steps)) +
                      ", allows; take a longer step, or raise max_steps");
  if (settings.output_step && span / *settings.output_step > kMostRows)
    checker.issue(checker.path("output_step"),
                  "is " + text_of(*settings.output_step) + " s: more than " + text_of(kMostRows) +
                      " rows of trajectory.csv; take a longer one, or an earlier end_time");
  if (settings.accuracy && *settings.accuracy >= 1)
    checker.issue(checker.path("accuracy"), "is " + text_of(*settings.accuracy) + ", a relative error must be below 1");
  if (!settings.events.empty() && has_word(kMultistepMethods, settings.integrator.type))
    checker.issue(checker.path("events"),
                  "are times at which a step ends; " + settings.integrator.type +
                      " does not end steps there: leave them out, or take a Runge-Kutta method");
  for (std::size_t i = 0; i < settings.events.size(); ++i) {
    const double event = settings.events[i];
    if (!(event > settings.start_time && event < settings.end_time))
      checker.issue(child_path(checker.path("events"), i),
                    "is " + text_of(event) + " s, it must lie between start_time, " + text_of(settings.start_time) +
                        " s, and end_time, " + text_of(settings.end_time) + " s");
  }
}

}  // namespace mbsopt
