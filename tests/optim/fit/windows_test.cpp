// Experiments that are cut into windows.
#include "optim/fit/windows.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/identification.hpp"
#include "optim/fit/unknown_parameters.hpp"
#include "tests/optim/fit/windowed_pendulum.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

TEST_CASE("windows take every sample once, and the last takes what is left", "[identification][windows]") {
  const CsvTable data = motion(windowed(), 0);
  for (const auto& [length, windows] : {std::pair{1.0, 4u}, {1.5, 3u}, {1.7, 2u}, {9.0, 1u}}) {
    const CutProblem cut = cut_into_windows(windowed(length), {data});
    const std::vector<ExperimentSpec>& specs = cut.problem.identification->experiments;
    REQUIRE(specs.size() == windows);
    REQUIRE(cut.warnings.size() == (length > 4 ? 1 : 0));
    if (length > 4) CHECK_THAT(cut.warnings[0], Contains("windows.length: is 9 s, but the record has only 4 s"));
    std::vector<double> t;
    for (std::size_t w = 0; w < specs.size(); ++w) {
      CHECK(specs[w].name == "swing." + std::to_string(w + 1));
      CHECK(specs[w].origin->number == w + 1);
      CHECK(*specs[w].start_time == Approx(static_cast<double>(w) * length));
      t.insert(t.end(), cut.data[w].columns[0].begin(), cut.data[w].columns[0].end());
    }
    CHECK(*specs.back().end_time == 4);
    CHECK(t == data.columns[0]);
  }
}

TEST_CASE("an experiment after one with windows keeps its place in the problem file", "[identification][windows]") {
  Problem p = windowed();
  p.identification->experiments.push_back(p.identification->experiments[0]);
  p.identification->experiments[1].name = "second", p.identification->experiments[1].windows.reset();
  const CsvTable data = motion(p, 0);
  const CutProblem cut = cut_into_windows(p, {data, data});
  const IdentificationSpec& spec = *cut.problem.identification;
  REQUIRE(spec.experiments.size() == 5);
  CHECK(place_of(spec, 3) == "identification.experiments[0]");
  CHECK(place_of(spec, 4) == "identification.experiments[1]");
}

TEST_CASE("starts of windows are guessed from the samples, with wrong parameters too", "[identification][windows]") {
  Problem p = windowed();
  const CsvTable data = motion(p, 0);
  ExperimentSpec whole = p.identification->experiments[0];
  parameter(p, "c2").value = 0.8, parameter(p, "d").value = 0.3, parameter(p, "q1").value = 0;
  const CutProblem cut = cut_into_windows(p, {data});
  for (std::size_t w = 1; w < 4; ++w) {
    const std::vector<std::pair<std::string, double>>& starts = cut.problem.identification->experiments[w].overrides;
    REQUIRE(starts.size() == 4);
    const std::size_t row = 100 * w;
    const auto rate = [&](std::size_t c) {  // of the exact record, by central differences: h^2/6 of a third derivative
      return (data.columns[c][row + 1] - data.columns[c][row - 1]) / 0.02;
    };
    CHECK(starts[0].second == Approx(data.columns[1][row] + M_PI / 2).margin(0.01));
    CHECK(starts[1].second == Approx(data.columns[2][row]).margin(0.01));
    CHECK(starts[2].second == Approx(rate(1)).margin(0.2));  // rates reach 5 rad/s
    CHECK(starts[3].second == Approx(rate(2)).margin(0.2));
  }
}

TEST_CASE("windows find the parameters from wrong ones", "[identification][windows]") {
  Problem p = windowed();
  const std::vector<CsvTable> data{motion(p, kWindowNoise)};
  parameter(p, "c2").value = 0.9, parameter(p, "d").value = 0.5;
  parameter(p, "q1").value = -0.5, parameter(p, "q2").value = -1, parameter(p, "o1").value = 3;
  const IdentificationResult result = run_identification(p, data);
  REQUIRE(result.ok());
  CHECK(std::abs(result.parameters[0].value - 0.6) < 4 * result.parameters[0].std_error);
  CHECK(std::abs(result.parameters[1].value - 0.05) < 4 * result.parameters[1].std_error);
  CHECK(result.parameters.size() == 2 + 4 * 4);
  CHECK(result.parameters[2].name == "swing.1.q1");
  CHECK(result.experiments[3].window->number == 4);
  for (const ExperimentFit& e : result.experiments) CHECK(e.rms == Approx(kWindowNoise).epsilon(0.2));
}

TEST_CASE("windows: what is free must act on the start", "[identification][windows]") {
  const CsvTable data = motion(windowed(), 0);
  Problem p = windowed();
  p.identification->experiments[0].free.clear();
  CHECK_THROWS_WITH(cut_into_windows(p, {data}), Contains("identification.experiments[0].free: is empty"));
  p = windowed();
  p.identification->variables = {"c2"};
  p.identification->experiments[0].free.push_back("d");
  CHECK_THROWS_WITH(cut_into_windows(p, {data}),
                    Contains("experiments[0].free: 'd' does not act on the initial state"));
  p = windowed(1e-3);
  CHECK_THROWS_WITH(cut_into_windows(p, {data}), Contains("experiments[0].windows.length: is 0.001 s"));
  p = windowed();
  p.identification->experiments[0].windows->start_time = 5;
  CHECK_THROWS_WITH(cut_into_windows(p, {data}), Contains("experiments[0].windows: end at 4 s"));
}

TEST_CASE("windows that continue each other start freely in all coordinates and rates", "[identification][windows]") {
  Problem p = windowed();
  const CsvTable data = motion(p, 0);
  p.identification->experiments[0].windows->continuity = true;
  CHECK_NOTHROW(cut_into_windows(p, {data}));
  p.scene.conditions[0].rate = f("0.5"), p.scene.conditions[0].value = f("q1 + o1 - pi/2");
  CHECK_THROWS_WITH(cut_into_windows(p, {data}),
                    Contains("experiments[0].windows.continuity: needs a start that is free") &&
                        Contains("2 each; the experiment's free parameters move 2 and 1 of them"));
}

TEST_CASE("windows that continue each other: exact data are fitted exactly", "[identification][windows]") {
  Problem p = windowed(0.5);
  const CsvTable data = motion(p, 0);
  p.identification->experiments[0].windows->continuity = true;
  parameter(p, "c2").value = 0.62;
  const IdentificationResult fit = run_identification(p, {data});
  INFO(fit.message);
  CHECK(fit.status == SolverStatus::converged);
  CHECK(fit.parameters[0].value == Approx(0.6).epsilon(1e-6));
}

TEST_CASE("windows: the guesses of starts end on request", "[identification][windows]") {
  const Problem p = windowed();
  const CsvTable data = motion(p, 0);
  int asked = 0;
  const CutProblem cut = cut_into_windows(p, {data}, [&](double) { return ++asked < 3; });
  CHECK(asked == 3);
  CHECK(cut.warnings.empty());
  REQUIRE(cut.problem.identification->experiments.size() == 4);
  const std::vector<ExperimentSpec>& windows = cut.problem.identification->experiments;
  CHECK(windows[3].overrides == windows[2].overrides);
}
