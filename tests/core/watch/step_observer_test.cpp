#include "core/watch/step_observer.hpp"

#include <catch2/catch.hpp>

#include "core/integrate/runge_kutta_run.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

struct Objector final : StepObserver {
  std::string look_at(const SeenStep& step) override { return step.to.t > 0.3 ? "the tip is too low" : ""; }
};

}  // namespace

TEST_CASE("an objection of an observer ends the run in its words", "[observer]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.4;
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  StepAttempt attempt(mechanism, scene.simulation, *runge_kutta_method("dopri5"));
  Objector objector;
  StepObserver* const observer = &objector;
  SimulationResult result;
  const RunOptions options;
  RungeKuttaRun(attempt, {}, options, result).go(assembly.result().y, assembly.result().angles, {&observer, 1});
  CHECK(result.status == SimulationStatus::not_credible);
  CHECK(result.message == "the tip is too low");
  CHECK(result.last_good_time < 0.3);
}
