// What a file without an integrator is run with, and how exact that is.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "app/json/read_problem.hpp"
#include "core/scene/default_integrator.hpp"
#include "optim/problem/logged_columns.hpp"
#include "optim/tradeoff/fit_errors.hpp"
#include "optim/tradeoff/tradeoff_reference.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

IntegratorSettings read(const std::vector<std::string>& sets) {
  return read_problem_text(kPendulum, "rod.json", sets).scene.simulation.integrator;
}

// Largest error of a kind.
double largest(const TradeoffErrors& measures, const Answer& answer, QuantityKind kind) {
  double worst = 0;
  const Eigen::VectorXd errors = measures.of(answer);
  for (std::size_t q = 0; q < measures.quantities().size(); ++q) {
    const Quantity& quantity = measures.quantities()[q];
    if (quantity.kind != kind) continue;
    const double error = errors(static_cast<Eigen::Index>(q));
    CHECK(std::isfinite(error));
    CHECK(quantity.certificate < 1e-6);
    worst = std::max(worst, error);
  }
  return worst;
}

}  // namespace

TEST_CASE("a file that leaves the integrator out gets dopri853 at 1e-8 and at least 150 steps", "[defaults]") {
  const IntegratorSettings left_out = read({});
  CHECK(left_out.type == "dopri853");
  CHECK(left_out.rtol == 1e-8);
  CHECK(left_out.atol == 1e-10);
  CHECK(left_out.max_step == Approx(1 / 150.0));  // of one second
  CHECK(read({"simulation.end_time=3"}).max_step == Approx(0.02));
}

TEST_CASE("what a file says of the integrator is kept, and the rest fits it", "[defaults]") {
  const IntegratorSettings tighter = read({"simulation.integrator.rtol=1e-10"});
  CHECK(tighter.type == "dopri853");
  CHECK(tighter.rtol == 1e-10);
  CHECK(tighter.max_step.has_value());
  const IntegratorSettings named = read({"simulation.integrator.type=dopri853"});
  CHECK(named.rtol == 1e-8);
  CHECK_FALSE(named.max_step.has_value());
  const IntegratorSettings other = read({"simulation.integrator.type=radau5"});
  CHECK(other.rtol == 1e-6);
  CHECK(other.atol == 1e-8);
  CHECK_FALSE(other.max_step.has_value());
  CHECK(read({"simulation.integrator.max_step=0.5"}).max_step == 0.5);
  CHECK_FALSE(read({"simulation.integrator.step=0.02"}).max_step.has_value());
  CHECK_FALSE(read({"simulation.accuracy=draft"}).max_step.has_value());
}

// The three that need it most: a quadrature that no step-size control sees, a kink that only a derivative sees, a long
// swing. All of the gallery: docs/tradeoffs.md.
TEST_CASE("default settings give objectives to 1e-5 and gradients to 1e-4", "[defaults][gallery]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  for (const char* name : {"joints/screw_press", "damper/identify_law", "joints/gear_train"}) {
    const Problem problem = read_problem(file_of(name));
    const TradeoffRuns runs(problem.scene, objectives_of(problem));
    const TradeoffReference reference =
        converged_reference(runs, {.seconds_per_run = std::numeric_limits<double>::infinity()});
    INFO(name << ": " << reference.message);
    REQUIRE(reference.ok());
    SimulationSettings defaults = problem.scene.simulation;
    defaults.formulation = {};
    defaults.integrator = default_integrator(defaults.start_time, defaults.end_time);
    const Answer answer = runs.gradients(defaults, GradientMethod::adjoint);
    REQUIRE(answer.ok);
    CHECK(largest(*reference.errors, answer, QuantityKind::objective) < 1e-5);
    CHECK(largest(*reference.errors, answer, QuantityKind::gradient) < 1e-4);
  }
}

TEST_CASE("what identify minimises has an error like any objective", "[defaults][gallery]") {
  const Problem problem = read_problem(file_of("spring_damper/identify"));
  std::vector<CsvTable> data;
  for (const ExperimentSpec& e : problem.identification->experiments) data.push_back(read_record(e));
  SimulationSettings defaults = problem.scene.simulation, loose = defaults;
  defaults.integrator = default_integrator(defaults.start_time, defaults.end_time);
  loose.integrator.type = "bs3", loose.integrator.rtol = 1e-3, loose.integrator.atol = 1e-5;
  const FitErrors errors(problem, data);
  INFO(errors.certificate().message);
  REQUIRE(errors.ok());
  CHECK(errors.cost() > 0);
  CHECK(errors.certificate().largest() < 1e-9);
  const FitErrors::Error by_default = errors.at(defaults), by_loose = errors.at(loose);
  REQUIRE((by_default.ok() && by_loose.ok()));
  CHECK(by_default.cost < 1e-5);
  CHECK(by_default.gradient < 1e-4);
  CHECK(by_loose.cost > 1e-5);
  CHECK(by_loose.gradient > 1e-5);
  const FitErrors stopped(problem, data, [] { return true; });
  CHECK_FALSE(stopped.ok());
}
