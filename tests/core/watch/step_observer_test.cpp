#include "core/watch/step_observer.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/integrate/runge_kutta_run.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Wants steps to end at some instants, as an event would.
struct Splitter final : StepObserver {
  std::vector<double> instants, ends;
  std::string objection;

  double split(const SeenStep& step) override {
    for (const double t : instants)
      if (t > step.from.t + 1e-9 && t < step.to.t - 1e-9) return t;
    return INFINITY;
  }
  std::string look_at(const SeenStep& step) override {
    ends.push_back(step.to.t);
    return step.to.t > 0.3 ? objection : "";
  }
};

SimulationResult run_with(Splitter& splitter, std::optional<double> step) {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.4;
  scene.simulation.integrator.step = step;
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  StepAttempt attempt(mechanism, scene.simulation, *runge_kutta_method("dopri5"));
  StepObserver* const observer = &splitter;
  SimulationResult result;
  const RunOptions options;
  RungeKuttaRun(attempt, {}, options, result).go(assembly.result().y, assembly.result().angles, {&observer, 1});
  return result;
}

}  // namespace

TEST_CASE("a step ends where an observer wants it to, and the grid behind it stays", "[observer]") {
  const std::optional<double> step = GENERATE(std::optional<double>(), std::optional<double>(0.01));
  Splitter none, two;
  two.instants = {0.1234, 0.1235, 0.301};
  const SimulationResult plain = run_with(none, step), split = run_with(two, step);
  REQUIRE((plain.ok() && split.ok()));
  for (const double t : two.instants) {
    CHECK(std::ranges::any_of(two.ends, [&](double end) { return std::abs(end - t) < 1e-12; }));
  }
  CHECK(two.ends.back() == 0.4);
  CHECK((plain.y_end - split.y_end).norm() < 1e-6 * plain.y_end.norm());
  if (!step) return;
  CHECK(split.statistics.steps == plain.statistics.steps + 3);
  for (const double t : none.ends) {
    CHECK(std::ranges::any_of(two.ends, [&](double end) { return std::abs(end - t) < 1e-12; }));
  }
}

TEST_CASE("an objection of an observer ends the run in its words", "[observer]") {
  Splitter objector;
  objector.objection = "the tip is too low";
  const SimulationResult result = run_with(objector, {});
  CHECK(result.status == SimulationStatus::not_credible);
  CHECK(result.message == "the tip is too low");
  CHECK(result.last_good_time < 0.3);
}
