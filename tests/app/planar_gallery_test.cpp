// The gallery's planar files: three unknowns per body give the motion and the gradient of six.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "app/json/read_problem.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/tradeoff/tradeoff_runs.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Of the whole gradient in units of the parameters, and of the values.
double apart(const Problem& problem, const Evaluation& a, const Evaluation& b) {
  double worst = 0;
  for (Eigen::Index i = 0; i < b.psi.size(); ++i) {
    worst = std::max(worst, std::abs(a.psi(i) - b.psi(i)) / std::max(std::abs(b.psi(i)), 1e-12));
    double largest = 0, difference = 0;
    for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k) {
      const Eigen::Index column = static_cast<Eigen::Index>(k);
      const double size = std::max(std::abs(problem.scene.parameters[k].value), 1e-3);
      largest = std::max(largest, size * std::abs(b.psi_rho(i, column)));
      difference = std::max(difference, size * std::abs(a.psi_rho(i, column) - b.psi_rho(i, column)));
    }
    worst = std::max(worst, difference / std::max(largest, 1e-12));
  }
  return worst;
}

enum class By { file, defaults, dopri5_at_1e9, dopri853_at_1e9 };

// The file's problem, by its own settings or by others.
Problem to_compare(const std::string& name, By by) {
  Problem problem = read_problem(file_of(name));
  SimulationSettings& simulation = problem.scene.simulation;
  if (by == By::file) return problem;
  simulation.formulation = {};
  simulation.accuracy.reset();
  simulation.integrator = default_integrator(simulation.start_time, simulation.end_time);
  if (by != By::defaults) {
    simulation.integrator = {};
    simulation.integrator.type = by == By::dopri5_at_1e9 ? "dopri5" : "dopri853";
    simulation.integrator.rtol = 1e-9, simulation.integrator.atol = 1e-11;
  }
  if (name == "governor/stiff_flyball") simulation.end_time = 0.05;  // explicit steps crawl through it
  // It comes to rest, where steps at the border of stability magnify rounding up to atol.
  if (name == "quarter_car/ride") simulation.integrator.atol = 1e-13;
  return problem;
}

EvaluatorOptions by_adjoint() {
  EvaluatorOptions options;
  options.method = GradientMethod::adjoint;
  return options;
}

// Parameters that differ by so many units in their last places.
Eigen::VectorXd beside(const Eigen::VectorXd& rho, double units) {
  return rho * (1 + units * std::numeric_limits<double>::epsilon());
}

// On these steps, in space.
Evaluation spatial(Scene scene, const std::vector<Objective>& objectives, const StepSequence& steps, double units = 0) {
  scene.simulation.model = ModelChoice::spatial;
  const Evaluator evaluator(std::move(scene), objectives, {}, by_adjoint());
  return evaluator.gradients_on(steps, beside(evaluator.start(), units), GradientMethod::adjoint);
}

bool is_planar(const Problem& problem) {
  return Mechanism(problem.scene, parameter_values(problem.scene)).data().planar != nullptr;
}

}  // namespace

// Where steps are at the limit of stability (stiff_coupling), either model magnifies rounding: they may then differ by
// what a unit in the last place of the parameters changes in one.
TEST_CASE("the planar model gives the values and gradients of the spatial one on the planar gallery", "[planar]") {
  const By by = GENERATE(By::defaults, By::dopri5_at_1e9, By::dopri853_at_1e9);
  int files = 0;
  for (const std::string& name : gallery()) {
    if (name == "four_bar/windows" && by != By::dopri5_at_1e9) continue;  // magnifies rounding: below
    const Problem problem = to_compare(name, by);
    const std::vector<Objective> objectives = objectives_of(problem);
    if (std::ranges::none_of(objectives, &Objective::needs_simulation)) continue;
    if (problem.scene.parameters.empty() || !is_planar(problem)) continue;
    ++files;
#ifdef __SANITIZE_ADDRESS__
    if (files % 4 != 0) continue;  // twenty times slower
#endif
    Evaluator planar(problem.scene, objectives, {}, by_adjoint());
    const Evaluation& a = planar.gradients(planar.start());
    const Evaluation b = spatial(problem.scene, objectives, a.steps);
    INFO(name << ": " << a.message << b.message);
    REQUIRE((a.ok && b.ok));
    CHECK((a.statistics.solved || a.statistics.factor_blocks > 0));  // blocks of 3 x 3
    const double difference = apart(problem, a, b);
    double allowed = a.steps.events.empty() ? 1e-10 : 1e-6;  // each model finds instants of its own
    for (const double units : {2.0, -2.0})
      if (difference >= 1e-10)
        allowed = std::max(allowed, 2 * apart(problem, spatial(problem.scene, objectives, a.steps, units), b));
    CHECK(difference < allowed);
  }
  CHECK(files >= 12);
}

// Step-size control sees estimates of error that differ by rounding, and magnifies them there, too.
TEST_CASE("both models take steps of their own to the same values and gradients on the planar gallery", "[planar]") {
  const By by = GENERATE(By::file, By::defaults);
  int files = 0;
  for (const std::string& name : gallery()) {
    if (name == "four_bar/windows" && by == By::defaults) continue;  // below
    const Problem problem = to_compare(name, by);
    const std::vector<Objective> objectives = objectives_of(problem);
    if (objectives.empty() || problem.scene.parameters.empty() || !is_planar(problem)) continue;
    ++files;
#ifdef __SANITIZE_ADDRESS__
    if (files % 4 != 0) continue;
#endif
    Evaluator planar(problem.scene, objectives, {}, by_adjoint());
    Scene scene = problem.scene;
    scene.simulation.model = ModelChoice::spatial;
    Evaluator spatial(std::move(scene), objectives, {}, by_adjoint());
    const Evaluation &a = planar.gradients(planar.start()), &b = spatial.gradients(spatial.start());
    INFO(name << ": " << a.message << b.message);
    REQUIRE((a.ok && b.ok));
    const auto fewer_or_more = [&](const Evaluation& e) {
      return std::abs(static_cast<long>(e.steps.sizes.size()) - static_cast<long>(b.steps.sizes.size()));
    };
    const double difference = apart(problem, a, b);
    double allowed = a.steps.events.empty() ? 1e-10 : 1e-6;  // each model finds instants of its own
    long steps_allowed = 0;
    if (difference >= allowed || fewer_or_more(a) > 0) {
      for (const double units : {2.0, -2.0}) {
        const Evaluation near = spatial.gradients(beside(spatial.start(), units));
        allowed = std::max(allowed, 2 * apart(problem, near, b));
        steps_allowed = std::max(steps_allowed, fewer_or_more(near));
      }
    }
    CHECK(difference < allowed);
    CHECK(fewer_or_more(a) <= steps_allowed);
  }
  CHECK(files >= 12);
}

// Flat positions magnify the rounding of either model, by a method of order 8 more than by one of order 5, but not more
// and more as steps become smaller.
TEST_CASE("the planar model gives the gradient of the spatial one through singular positions, whatever the tolerance",
          "[planar]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem problem = to_compare("four_bar/windows", By::dopri853_at_1e9);
  const std::vector<Objective> objectives = objectives_of(problem);
  for (const double rtol : {1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
    problem.scene.simulation.integrator.rtol = rtol, problem.scene.simulation.integrator.atol = 0.01 * rtol;
    Evaluator planar(problem.scene, objectives, {}, by_adjoint());
    const Evaluation& a = planar.gradients(planar.start());
    const Evaluation b = spatial(problem.scene, objectives, a.steps);
    INFO("rtol " << rtol << ": " << a.message << b.message);
    REQUIRE((a.ok && b.ok));
    CHECK(apart(problem, a, b) < 1e-9);
  }
}

// A step cut to the limit after it was placed would pass anywhere.
TEST_CASE("a limit of steps does not spoil gradients through singular positions", "[planar]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem problem = to_compare("four_bar/windows", By::defaults);
  const std::vector<Objective> objectives = objectives_of(problem);
  for (int k = 0; k < 30; ++k) {
    problem.scene.simulation.integrator.atol = 1e-10 * (1 + 0.05 * k);
    Evaluator planar(problem.scene, objectives, {}, by_adjoint());
    const Evaluation& a = planar.gradients(planar.start());
    const Evaluation b = spatial(problem.scene, objectives, a.steps);
    INFO("atol " << problem.scene.simulation.integrator.atol << ": " << a.message << b.message);
    REQUIRE((a.ok && b.ok));
    CHECK(apart(problem, a, b) < 3e-10);
  }
}

TEST_CASE("the planar model takes the spatial one's path on the planar gallery", "[planar]") {
  int files = 0;
  for (const std::string& name : gallery()) {
    const Problem problem = to_compare(name, By::dopri853_at_1e9);
    if (!is_planar(problem)) continue;
    ++files;
#ifdef __SANITIZE_ADDRESS__
    if (files % 4 != 0) continue;
#endif
    const TradeoffRuns runs(problem.scene, {});
    SimulationSettings in_space = problem.scene.simulation;
    in_space.model = ModelChoice::spatial;
    const Answer planar = runs.motion(problem.scene.simulation);
    INFO(name << ": " << planar.message);
    REQUIRE(planar.ok);
    in_space.solve = Solve::dynamics;
    SampledMotion spatial{planar.motion.times, {}, {}, {}};
    const SimulationResult run = simulate(runs.mechanism(), in_space, {}, record_motion(runs.mechanism(), spatial),
                                          {.frozen = &planar.steps, .progress = {}});
    INFO(run.message);
    REQUIRE(run.ok());
    const MotionDistance distance(runs.mechanism());
    const double extent = std::max(distance.extent(spatial, planar.y_initial), 1e-3);  // [m]; one is at rest
    CHECK(distance.between(planar.motion, spatial) < 1e-10 * extent);
  }
  CHECK(files >= 12);
}
