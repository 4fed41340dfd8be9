// alpha from 1e0 to 1e16, in both formulations: the motion of the constrained equations, or words.
#include "tests/app/run_command.hpp"
#include "tests/extremes/four_bar.hpp"

using namespace mbsopt;
using namespace mbsopt::extremes;
using Catch::Matchers::Contains;

namespace {

double time_error(const Outcome& outcome) {
  return std::abs(FourBar().time_to(outcome("theta")) - 1);  // the run takes 1 s
}

Outcome with_penalty(double alpha, const std::string& solver) {
  Json p = FourBar().json();
  set_accuracy(p, "dopri853", 1e-10);
  p["simulation"]["formulation"] = {{"type", "penalty"}, {"alpha", alpha}, {"linear_solver", solver}};
  return values(p);
}

}  // namespace

TEST_CASE("augmented Lagrangian: with alpha from 1e1 to 1e15 the motion is the exact one", "[extremes]") {
  const double alpha = GENERATE(1e1, 1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e13, 1e14);
  Json p = FourBar().json();
  p["simulation"]["formulation"] = {{"type", "augmented_lagrangian"}, {"alpha", alpha}};
  const Outcome run = values(p);
  INFO("alpha " << alpha << ": " << run.message());
  REQUIRE(run.ok());
  CHECK(time_error(run) < 1e-7);
}

TEST_CASE("augmented Lagrangian: an alpha with which the constraints are not met, or nothing is, says so",
          "[extremes]") {
  const double alpha = GENERATE(1e0, 1e16);
  Json p = FourBar().json();
  p["simulation"]["formulation"] = {{"type", "augmented_lagrangian"}, {"alpha", alpha}};
  const Outcome run = values(p);
  INFO("alpha " << alpha);
  REQUIRE_FALSE(run.ok());
  CHECK_THAT(run.message(), Contains(alpha > 1 ? "simulation.formulation.alpha is too large: 1e+16, where 1e8 is usual"
                                               : "use a larger simulation.formulation.alpha"));
}

TEST_CASE("penalty: the motion comes nearer to the exact one as 1/alpha, down to what the tolerances leave",
          "[extremes]") {
  double before = 0;
  for (const double alpha : {1e4, 1e5, 1e6}) {
    const Outcome run = with_penalty(alpha, "quasidefinite");
    INFO("alpha " << alpha << ": " << run.message());
    REQUIRE(run.ok());
    const double error = time_error(run);
    if (before > 0) CHECK(before / error == Approx(10).epsilon(0.3));
    before = error;
  }
  for (const double alpha : {1e10, 1e12, 1e14, 1e16}) {
    const Outcome run = with_penalty(alpha, "quasidefinite");
    INFO("alpha " << alpha << ": " << run.message());
    REQUIRE(run.ok());
    CHECK(time_error(run) < 1e-7);
  }
}

TEST_CASE("penalty: joints that come apart are a warning that names alpha", "[extremes]") {
  const TemporaryFolder folder;
  Json p = FourBar().json();
  p["simulation"]["formulation"] = {{"type", "penalty"}, {"alpha", GENERATE(1e0, 1e1)}};
  const CommandOutcome run =
      run_command({"simulate", folder.write("four_bar.json", p.dump()), "--out", folder.file("out")});
  CHECK(run.exit_code == 0);
  CHECK_THAT(run.err, Contains("warning: ") && Contains("simulation.formulation.alpha is 1") && Contains("raise it"));
  CHECK(json_of(folder.path / "out/result.json").at("warnings").size() == 1);
}

TEST_CASE("penalty by Cholesky: an alpha that leaves too few digits is a warning, and one that leaves none an error",
          "[extremes]") {
  const double alpha = GENERATE(1e12, 1e14, 1e16);
  const TemporaryFolder folder;
  Json p = FourBar().json();
  p["simulation"]["formulation"] = {{"type", "penalty"}, {"alpha", alpha}};
  p["simulation"]["integrator"] = {{"max_steps", 2000}};
  p["simulation"]["end_time"] = 0.1;
  const CommandOutcome run =
      run_command({"simulate", folder.write("four_bar.json", p.dump()), "--out", folder.file("out")});
  INFO("alpha " << alpha);
  CHECK_THAT(run.err, Contains("warning: ") && Contains("simulation.formulation") && Contains("quasidefinite"));
  CHECK((run.exit_code == 0 || run.exit_code == 1));
  if (alpha == 1e16) CHECK_THAT(run.err, Contains("simulate failed: ") && Contains("simulation.formulation.alpha"));
}
