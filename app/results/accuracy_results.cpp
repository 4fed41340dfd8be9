#include "app/results/accuracy_results.hpp"

#include <fmt/format.h>

#include "app/terminal/interrupt.hpp"
#include "core/expression/counted.hpp"
#include "core/watch/stiffness.hpp"

namespace mbsopt::inline app {
namespace {

// "engineering (1e-05): dopri5 at rtol 1e-06, atol 1e-08; ..."
std::string in_words(const AccuracyChoice& choice) {
  const IntegratorSettings& s = choice.settings.integrator;
  std::string errors;
  for (const ErrorEstimate& e : choice.estimates) {
    const bool rounding = e.error <= AccuracyChoice::kRounding;
    errors += fmt::format("{}{} {:.1e}{} in {}", errors.empty() ? "" : ", ", rounding ? "at most" : "about", e.error,
                          e.relative ? "" : " (absolute)", e.quantity);
  }
  return fmt::format("{} is wanted: {} at rtol {:g}, atol {:g} ({}). Estimated error: {}, by a run of {} at rtol {:g}",
                     accuracy_in_words(choice.wanted), s.type, s.rtol, s.atol, choice.why, errors,
                     choice.verified_by.type, choice.verified_by.rtol);
}

Json to_json(const AccuracyChoice& choice, const std::string& words) {
  Json json{{"in_words", words},
            {"wanted", choice.wanted},
            {"reached", choice.reached},
            {"integrator", to_json(choice.settings.integrator)},
            {"verified_by", to_json(choice.verified_by)},
            {"estimated_error", choice.largest_error()},
            {"rounding", AccuracyChoice::kRounding}};
  for (const ErrorEstimate& e : choice.estimates)
    json["errors"][e.quantity] = {{"estimate", e.error}, {"relative", e.relative}};
  json["features"] = {{"stability_limited", choice.limited_steps}, {"fastest_rate", choice.stiffest_rate}};
  json["simulations"] = choice.simulations;
  return json;
}

}  // namespace

bool settle_accuracy(Run& run, const Scene& simulated, const std::vector<Objective>& objectives) {
  const SimulationSettings& given = run.problem.scene.simulation;
  if (!given.accuracy) return true;
  AccuracyOptions options;
  if (run.context.command == "identify") options.without_objectives = QuantityKind::sensors;
  std::string doing;
  options.progress = [&](int simulations) {
    doing = fmt::format("choosing an integrator: simulation {}", simulations);
    run.progress.iteration(doing);
  };
  options.limit.interrupted = [&] {  // asked after each step
    run.progress.stands(doing);
    return interrupted();
  };
  const AccuracyChoice choice = choose_accuracy(simulated, objectives, options);
  run.progress.finish();
  if (interrupted()) {
    run.stopped("the integrator was not chosen yet");
    return false;
  }
  SimulationSettings settings = given;
  settings.accuracy.reset();
  settings.integrator = choice.settings.integrator;
  run.simulate_with(settings);
  if (!choice.ok) {
    run.warn(
        fmt::format("no integrator could be chosen for simulation.accuracy, the default is used: {}", choice.message));
    return true;
  }
  const std::string words = in_words(choice);
  run.result["accuracy"] = to_json(choice, words);
  run.context.out << fmt::format("accuracy: {}; {}\n", words, counted(choice.simulations, "simulation"));
  if (!choice.reached)
    run.warn(
        fmt::format("simulation.accuracy: {:.0e} is not reached, the estimated error is {:.1e} (rounding, a chaotic "
                    "motion, a singular position, or a law that is not smooth?)",
                    choice.wanted, choice.largest_error()));
  return true;
}

bool settle_accuracy(Run& run) {
  const Scene scene = run.problem.scene;
  return settle_accuracy(run, scene, objectives_of(run.problem));
}

void warn_of_stiffness(Run& run, const SimulationStatistics& statistics, bool differentiated) {
  const std::string warning =
      stiffness_warning(statistics, run.problem.scene.simulation.integrator.type, differentiated);
  if (!warning.empty()) run.warn(warning);
}

}  // namespace mbsopt::inline app
