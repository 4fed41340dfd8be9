// Everything that the libraries compute on several threads: results are those of one thread, bit by bit.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "optim/fit/identification.hpp"
#include "optim/fit/recovery.hpp"
#include "optim/objective/evaluator.hpp"
#include "tests/optim/fit/windowed_pendulum.hpp"
#include "tests/optim/five_bar.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("load cases give the same bits in any number of threads", "[threads][cases]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  for (const char* k : {"90", "110", "130"}) {
    CaseSpec c;
    c.name = k, c.overrides = {{"k1", Expression::parse(k)}};
    problem.cases.push_back(c);
  }
  const std::vector<std::string> objectives{problem.objectives.front().name}, variables{"L01", "k2"};
  Evaluator one(problem, objectives, variables), three(problem, objectives, variables, {.threads = 3});
  const Evaluation a = one.gradients(one.start()), b = three.gradients(three.start());
  REQUIRE(a.ok);
  CHECK(a.psi(0) != a.psi(1));
  CHECK(a.psi == b.psi);
  CHECK(a.psi_rho == b.psi_rho);
}

TEST_CASE("windows give the same bits in any number of threads", "[threads][identification][windows]") {
  const Problem p = windowed();
  const std::vector<CsvTable> data{motion(p, kWindowNoise)};
  IdentificationOptions four;
  four.threads = 4;
  const IdentificationResult a = run_identification(p, data), b = run_identification(p, data, four);
  REQUIRE(a.ok());
  CHECK(a.evaluations == b.evaluations);
  for (std::size_t k = 0; k < a.parameters.size(); ++k) {
    CHECK(a.parameters[k].value == b.parameters[k].value);
    CHECK(a.parameters[k].std_error == b.parameters[k].std_error);
  }
}

TEST_CASE("doubts about a fit are the same in any number of threads", "[threads][identification]") {
  Problem problem = pendulum::problem(50, 0.5, 2.5, 0);
  add_parameters(problem.scene, {{"tp", 0.4}});
  problem.identification.emplace().experiments = {pendulum::experiment("swing", {})};
  problem.identification->variables = {"w2", "c", "tp"};
  Torque kick;  // tp moves its jump, so that differences disagree with derivatives
  kick.body = "arm", kick.components = {f("0"), f("0"), f("1e-3*abs(t - tp)/(t - tp)")};
  problem.scene.forces.push_back({"kick", kick});
  problem.scene.simulation.follows_kinks = false;
  const std::vector<CsvTable> data{pendulum::exact_motion(50, 0.5, 2.5, 0, 1)};
  const std::vector<std::string> one = start_of_fit(problem, data).warnings;
  CHECK_FALSE(one.empty());
  IdentificationOptions four;
  four.threads = 4;
  CHECK(start_of_fit(problem, data, four).warnings == one);
}

TEST_CASE("fits of simulated records have the scatter of the standard errors, in any number of threads",
          "[threads][recovery]") {
  const repetitions::Study study = repetitions::studies()[1];
  const std::vector<CsvTable> data = repetitions::repeated(study, 3);
  const IdentificationResult fit = run_identification(study.problem, data);
  const Recovery one = recover(study.problem, data, fit, {.seeds = 40}),
                 two = recover(study.problem, data, fit, {.seeds = 40, .threads = 2});
  REQUIRE(one.fits == 40);
  REQUIRE(two.parameters.size() == fit.parameters.size());
  for (std::size_t k = 0; k < fit.parameters.size(); ++k) {
    const RecoveredParameter &p = one.parameters[k], &same = two.parameters[k];
    INFO(p.name << ": scatter " << p.scatter);
    CHECK(p.scatter == Approx(fit.parameters[k].std_error).epsilon(0.5));
    CHECK(p.ci95[0] < p.mean);
    CHECK(p.mean < p.ci95[1]);
    CHECK(p.scatter == same.scatter);
    CHECK(p.ci95[0] == same.ci95[0]);
  }
}
