#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Four runs of a slider; the last one is of another spring.
struct Runs {
  Problem problem = repetitions::slider(50, 1.2);
  std::vector<CsvTable> data;
  explicit Runs(const std::vector<std::string>& free = {"x0", "v0"}) {
    problem.identification.emplace();
    problem.identification->variables = {"k", "c"};
    for (unsigned e = 0; e < 4; ++e) {
      problem.identification->experiments.push_back(repetitions::slider_run("run" + std::to_string(e), free));
      problem.identification->experiments.back().overrides = {{"v0", 0.1}};
      data.push_back(repetitions::damped_decay(e == 3 ? 25.02 : 25, 0.6, 0.2, 0.1, 2, 0.05));
      for (std::size_t i = 0; i < data.back().rows(); ++i)
        data.back().columns[1][i] += 1e-5 * std::sin(37. * static_cast<double>(i * i + e));
    }
  }
};

IdentificationResult checked_by_fits_without_each(const Runs& runs) {
  const IdentificationResult all = run_identification(runs.problem, runs.data);
  REQUIRE(all.ok());
  for (std::size_t e = 0; e < 4; ++e) {
    Problem fewer = runs.problem;
    std::vector<CsvTable> rest = runs.data;
    fewer.identification->experiments.erase(fewer.identification->experiments.begin() + static_cast<long>(e));
    rest.erase(rest.begin() + static_cast<long>(e));
    const IdentificationResult without = run_identification(fewer, rest);
    REQUIRE(without.ok());
    REQUIRE(all.experiments[e].influence);
    const Influence& influence = *all.experiments[e].influence;
    std::size_t k = 0;
    while (all.parameters[k].name != influence.parameter) ++k;
    const double change = (without.parameters[k].value - all.parameters[k].value) / all.parameters[k].std_error;
    INFO(influence.parameter << ": " << influence.change << ", really " << change);
    CHECK(influence.change == Approx(change).epsilon(0.02).margin(0.01));
  }
  return all;
}

}  // namespace

TEST_CASE("influence: as the fit without the experiment", "[identification]") {
  const IdentificationResult all = checked_by_fits_without_each(Runs());
  CHECK(std::abs(all.experiments[3].influence->change) > 1);
}

TEST_CASE("influence: priors of shared parameters belong to no experiment", "[identification]") {
  Runs runs;
  add_parameters(runs.problem.scene, {{"p", 1}});
  runs.problem.scene.parameters.back().prior = Prior{1, 0.01};
  std::get<Tsda>(runs.problem.scene.forces[0].kind).stiffness = Expression::parse("k*p");
  runs.problem.identification->variables.push_back("p");
  for (ExperimentSpec& e : runs.problem.identification->experiments) e.channels[0].sigma = 1e-5;
  checked_by_fits_without_each(runs);
}

TEST_CASE("influence: parameters stay within their bounds", "[identification]") {
  Runs runs;
  runs.problem.scene.parameters[1].lower = 1.21, runs.problem.scene.parameters[1].value = 1.3;  // c, truth 1.2
  const IdentificationResult all = checked_by_fits_without_each(runs);
  CHECK(all.parameters[1].at_lower);
}

TEST_CASE("influence: the parameter that no other experiment determines is named", "[identification]") {
  Runs runs(std::vector<std::string>{});
  add_parameters(runs.problem.scene, {{"g", 1}});
  runs.problem.identification->variables.push_back("g");
  runs.problem.identification->experiments[1].channels[0].gain = Expression::parse("g");
  const IdentificationResult all = run_identification(runs.problem, runs.data);
  REQUIRE(all.ok());
  CHECK(all.experiments[1].influence->parameter == "g");
  CHECK(std::isinf(all.experiments[1].influence->change));
  for (const std::size_t e : {0UL, 2UL, 3UL}) CHECK(std::isfinite(all.experiments[e].influence->change));
}
