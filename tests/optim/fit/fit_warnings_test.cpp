// Fits name copies of columns, runs that disagree, wrong units, and samples that a loss takes out.
#include "optim/fit/fit_warnings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "optim/fit/identification.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

namespace {

constexpr double kNoise = 0.01;

// Record of one pendulum that start at 1.5, 1.6, ... rad. The start of each is free.
struct Record {
  Problem problem = pendulum::problem(64.4, 0.06, 1.5, 1.5);
  std::vector<CsvTable> data;

  explicit Record(unsigned runs, double noise = kNoise) {
    problem.identification.emplace();
    problem.identification->variables = {"w2", "c"};
    for (unsigned e = 0; e < runs; ++e) {
      problem.identification->experiments.push_back(
          pendulum::experiment(fmt::format("run{}", e + 1), {"theta0", "omega0"}));
      problem.identification->experiments.back().overrides = {{"theta0", 1.5 + 0.1 * e}};
      data.push_back(pendulum::exact_motion(64, 0.055, 1.5 + 0.1 * e, 1.55, 2));
      pendulum::add_noise(data.back(), noise, e + 1);
    }
  }
  void estimate(SigmaEstimate how) {
    for (ExperimentSpec& e : problem.identification->experiments)
      for (ChannelSpec& c : e.channels) c.estimate_sigma = how;
  }
  std::string warnings() const { return fmt::format("{}", fmt::join(fitted().warnings, "\n")); }
  IdentificationResult fitted() const {
    IdentificationResult result = run_identification(problem, data);
    INFO(result.message);
    REQUIRE(result.ok());
    return result;
  }
};

// A second channel of the first run: the same sensor under another name.
void add_column(Record& runs, const std::string& name, const std::vector<double>& values) {
  ChannelSpec channel = runs.problem.identification->experiments[0].channels[0];
  channel.column = name;
  runs.problem.identification->experiments[0].channels.push_back(channel);
  runs.data[0].header.push_back(name), runs.data[0].columns.push_back(values);
}

std::vector<double> with_noise(std::vector<double> values, double sigma, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal(0, sigma);
  for (double& x : values) x += normal(generator);
  return values;
}

}  // namespace

TEST_CASE("a copy of a channel is named, also with a little noise of its own, or with its sign turned",
          "[identification][fit_warnings]") {
  Record runs(1);
  CHECK(runs.warnings().empty());
  SECTION("a plain copy") { add_column(runs, "copy", runs.data[0].columns[1]); }
  SECTION("with noise") { add_column(runs, "copy", with_noise(runs.data[0].columns[1], 0.1 * kNoise, 9)); }
  SECTION("with its sign turned") {
    std::vector<double> turned = runs.data[0].columns[1];
    for (double& x : turned) x = -x;
    add_column(runs, "copy", turned);
    runs.problem.identification->experiments[0].channels[1].gain = -1.0;
  }
  CHECK_THAT(runs.warnings(), Contains("'theta' and 'copy' in 'run1' change alike") && Contains("copy of the other"));
}

TEST_CASE("two sensors of one angle are no copies, even where the model errs alike in both",
          "[identification][fit_warnings]") {
  Record runs(1);
  const CsvTable exact = pendulum::exact_motion(64, 0.055, 1.5, 1.55, 2);
  add_column(runs, "second", with_noise(exact.columns[1], kNoise, 7));
  CHECK(runs.warnings().empty());
  runs.problem.identification->variables = {"w2"};  // its damping is wrong: errors of three sigma in both
  runs.problem.scene.parameters[1].value = 0.2;
  const IdentificationResult result = runs.fitted();
  CHECK(result.experiments[0].channels[0].rms > 2 * kNoise);
  CHECK_THAT(fmt::format("{}", fmt::join(result.warnings, "\n")), !Contains("change alike"));
}

TEST_CASE("a run that disagrees with two others is named, whatever the sigmas are", "[identification][fit_warnings]") {
  const SigmaEstimate how = GENERATE(SigmaEstimate::none, SigmaEstimate::shared, SigmaEstimate::own);
  Record runs(3);
  runs.estimate(how);
  CHECK(runs.warnings().empty());
  std::vector<double>& x = runs.data[2].columns[1];
  SECTION("its clock is 5 % fast") {
    for (double& t : runs.data[2].columns[0]) t *= 1.05;
  }
  SECTION("it is of another pendulum") {
    runs.data[2] = pendulum::exact_motion(58, 0.055, 1.7, 1.55, 2);
    pendulum::add_noise(runs.data[2], kNoise, 3);
  }
  SECTION("it is scaled") {
    for (double& value : x) value = M_PI + 1.2 * (value - M_PI);
  }
  const std::string warnings = runs.warnings();
  CHECK_THAT(warnings, Contains("experiment 'run3' disagrees with the others"));
  CHECK_THAT(warnings, !Contains("experiment 'run1'") && !Contains("experiment 'run2'"));
}

TEST_CASE("an estimated sigma far above the given one is questioned, and one that no file gives is not",
          "[identification][fit_warnings][sigma]") {
  Record runs(1);
  runs.estimate(SigmaEstimate::shared);
  Field& sigma = runs.problem.identification->experiments[0].channels[0].sigma;
  sigma = 0.3 * kNoise;
  CHECK(runs.warnings().empty());
  sigma = 0.02 * kNoise;
  CHECK_THAT(runs.warnings(), Contains("the sigma of 'theta' is estimated as 0.0") && Contains("the given 0.0002"));
  sigma = 1.0;
  for (double& x : runs.data[0].columns[1]) x *= 1e4;
  runs.problem.identification->experiments[0].channels[0].gain = 1e4;
  CHECK(runs.warnings().empty());
}

TEST_CASE("a channel that an estimated sigma gives up is questioned, one that rests is not",
          "[identification][fit_warnings][sigma]") {
  Record runs(1);
  runs.problem.scene.sensors.push_back(runs.problem.scene.sensors[0]);
  runs.problem.scene.sensors[1].name = "rate", runs.problem.scene.sensors[1].quantity = "rate";
  std::vector<double> rate{1.55};
  const std::vector<double> exact = pendulum::exact_motion(64, 0.055, 1.5, 1.55, 2).columns[1];
  for (std::size_t i = 1; i < exact.size(); ++i)
    rate.push_back(-(exact[i] - exact[i - 1]) / 0.01);  // its sign is wrong
  add_column(runs, "rate", with_noise(rate, 0.1, 5));
  runs.problem.identification->experiments[0].channels[1].sensor = "rate";
  runs.estimate(SigmaEstimate::own);
  CHECK_THAT(runs.warnings(), Contains("the fit explains nothing of 'rate' in 'run1'"));
  // A sensor that the motion does not move shows its mean and noise.
  runs.problem.scene.sensors[1].quantity = "angle";
  runs.problem.identification->experiments[0].channels[1].gain = 1e-9;
  runs.data[0].columns[2] = with_noise(std::vector<double>(exact.size(), 0.002), 0.01, 5);
  CHECK_THAT(runs.warnings(), !Contains("explains nothing"));
}

TEST_CASE("a loss that takes samples out names their rows, and the rest is judged",
          "[identification][fit_warnings][loss]") {
  Record runs(1);
  runs.data[0].name = "run.csv";
  runs.problem.identification->loss = {LossType::tukey};
  CHECK(runs.warnings().empty());
  std::vector<double>& x = runs.data[0].columns[1];
  x[20] = 1e5;
  for (const std::size_t i : {60u, 61u, 62u}) x[i] = -40;
  const IdentificationResult result = runs.fitted();
  CHECK(std::abs(result.parameters[0].value - 64) < 4 * result.parameters[0].std_error);
  const std::string warnings = fmt::format("{}", fmt::join(result.warnings, "\n"));
  CHECK_THAT(warnings, Contains("4 of 201 samples of 'theta' in 'run1'"));
  CHECK_THAT(warnings, Contains("run.csv:22 (0.2 s), run.csv:62 to run.csv:64 (0.6 to 0.62 s)"));
  CHECK_THAT(warnings, !Contains("explains nothing"));
}

TEST_CASE("a record is asked about degrees only if degrees explain it better", "[identification][fit_warnings]") {
  // The model starts near rest and stays there: its damping is held far too large. The record spans twenty times as
  // much, in radians.
  Record runs(1);
  runs.problem.scene.parameters[1].lower = runs.problem.scene.parameters[1].upper = 60;
  runs.problem.scene.parameters[1].value = 60;
  ExperimentSpec& e = runs.problem.identification->experiments[0];
  e.free.clear(), e.overrides = {{"theta0", 3.0}, {"omega0", 0.0}};
  for (double& x : runs.data[0].columns[1]) x = 3 + 2.5 * (x - 3);
  CHECK_THAT(runs.warnings(), !Contains("in degrees?"));
}

TEST_CASE("intervals of logarithmic parameters are products, and those at a bound have one side", "[identification]") {
  Record runs(1);
  Parameter &w2 = runs.problem.scene.parameters[0], &c = runs.problem.scene.parameters[1];
  w2.scale = ParameterScale::log;
  c.lower = 0.1, c.value = 0.2;  // the record has 0.055
  const IdentificationResult result = runs.fitted();
  const FittedParameter &of_w2 = result.parameters[0], &of_c = result.parameters[1];
  CHECK(of_w2.ci95[0] * of_w2.ci95[1] == Approx(of_w2.value * of_w2.value).epsilon(1e-12));
  CHECK(std::log(of_w2.ci95[1] / of_w2.value) ==
        Approx(result.statistics.quantile * of_w2.std_error / of_w2.value).epsilon(1e-9));
  CHECK(of_c.at_lower);
  CHECK(of_c.ci95[0] == 0.1);
  CHECK(of_c.ci95[1] == Approx(0.1 + result.statistics.quantile * of_c.std_error).epsilon(1e-9));
}

TEST_CASE("estimated sigmas end in the best optimum of their likelihood", "[identification][sigma]") {
  // A column of another pendulum, with a tenth of the noise: the likelihood has an optimum at either, and the one at
  // the quiet column is better by n log 10.
  Record runs(1);
  const CsvTable other = pendulum::exact_motion(61, 0.055, 1.5, 1.55, 2);
  add_column(runs, "quiet", with_noise(other.columns[1], 0.1 * kNoise, 8));
  runs.estimate(SigmaEstimate::shared);
  runs.problem.scene.parameters[0].value = 64;  // the optimum that is worse
  ExperimentSpec& e = runs.problem.identification->experiments[0];
  e.free.clear(), e.overrides = {{"theta0", 1.5}, {"omega0", 1.55}};
  const IdentificationResult result = runs.fitted();
  CHECK(result.parameters[0].value == Approx(61).epsilon(1e-3));
  CHECK(result.experiments[0].channels[1].sigma == Approx(0.1 * kNoise).epsilon(0.2));
  CHECK((result.history.back().parameters - Eigen::Vector2d(result.parameters[0].value, result.parameters[1].value))
            .norm() < 1e-9);
}
