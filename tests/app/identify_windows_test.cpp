// The arm with logged torques, in windows: a record of the project, and one of real hardware.
#include <fmt/format.h>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <string>

#include "app/json/read_problem.hpp"
#include "app/terminal/exit_code.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/logged_columns.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;

namespace {

const std::string kArm = MBSOPT_SOURCE_DIR "/problems/double_pendulum/identify_windows.json";
const std::string kMeasured = MBSOPT_SOURCE_DIR "/../shared/data/measured/dfki_double_pendulum_torque/record.csv";
const std::string kExperiment = "identification.experiments[0].";

const std::string kTumbling = MBSOPT_SOURCE_DIR "/problems/double_pendulum/identify_tumbling.json";

IdentificationResult fitted(const std::vector<std::string>& sets, const std::string& file = kArm) {
  const Problem problem = read_problem(file, sets);
  return run_identification(problem, {read_record(problem.identification->experiments[0])});
}

// The table of docs/identification.md says what these are.
std::vector<std::string> measured_between(double start, double end) {
  std::vector<std::string> sets{"signals.tau1.file=" + kMeasured,
                                "signals.tau2.file=" + kMeasured,
                                kExperiment + "data=" + kMeasured,
                                fmt::format("{}windows.start_time={}", kExperiment, start),
                                fmt::format("{}windows.end_time={}", kExperiment, end),
                                "simulation.integrator.rtol=1e-5",
                                "simulation.integrator.atol=1e-7",
                                "identification.optimizer.tolerance=1e-6"};
  for (int c = 0; c < 4; ++c) {
    sets.push_back(fmt::format("{}channels[{}].estimate_sigma=false", kExperiment, c));
    sets.push_back(fmt::format("{}channels[{}].sigma={}", kExperiment, c, c < 2 ? 0.008 : 0.25));
  }
  return sets;
}

double rms_of(const IdentificationResult& fit, std::size_t channel) {
  double squares = 0, samples = 0;
  for (const ExperimentFit& e : fit.experiments) {
    const double n = static_cast<double>(e.channels[channel].samples);
    squares += n * std::pow(e.channels[channel].rms, 2), samples += n;
  }
  return std::sqrt(squares / samples);
}

}  // namespace

TEST_CASE("the arm in windows: the parameters with which its record was made", "[identification][windows]") {
  const IdentificationResult fit = fitted({});
  REQUIRE(fit.ok());
  CHECK(fit.experiments.size() == 8);
  CHECK(fit.evaluations <= 15);
  const double truth[] = {0.25, 0.06, 0.16, 0.05, 0.1, 0.08, 0.02, 0.01};
  for (std::size_t k = 0; k < 8; ++k) {
    INFO(fit.parameters[k].name);
    CHECK(std::abs(fit.parameters[k].value - truth[k]) < 4 * fit.parameters[k].std_error);
    CHECK(fit.parameters[k].std_error < 0.01 * truth[k]);
  }
}

TEST_CASE("windows share a plot per channel, whose curves end with each window", "[report][windows]") {
  const TemporaryFolder folder;
  REQUIRE(run_command({"identify", kArm, "--out", folder.file("out")}).exit_code == kDone);
  const std::string page = content_of(folder.path / "out/report.html");
  CHECK(page.size() < 400'000);
  for (const std::string channel : {"pos_meas1", "pos_meas2", "vel_meas1", "vel_meas2"}) {
    INFO(channel);
    const std::string title = fmt::format("<figcaption class=\"title\">arm: {}<", channel),
                      line = "class=\"line c1\" d=\"";
    const std::size_t at = page.find(title), begin = page.find(line, at) + line.size();
    REQUIRE(at != std::string::npos);
    CHECK(page.find(title, at + 1) == std::string::npos);
    CHECK(page.find("arm.1: " + channel) == std::string::npos);
    const std::string path = page.substr(begin, page.find('"', begin) - begin);
    CHECK(std::ranges::count(path, 'm') == 8);  // a move to the start of each window
  }
}

TEST_CASE("the tumbling arm: windows that continue each other find what made its chaotic record",
          "[identification][continuity]") {
  const IdentificationResult fit = fitted({}, kTumbling);
  INFO(fit.message);
  REQUIRE(fit.ok());
  CHECK(fit.evaluations <= 30);
  const double truth[] = {0.06, 0.16, 0.05, 0.002, 0.001};
  for (std::size_t k = 0; k < 5; ++k) {
    INFO(fit.parameters[k].name);
    CHECK(std::abs(fit.parameters[k].value - truth[k]) < 4 * fit.parameters[k].std_error);
    CHECK(fit.parameters[k].std_error < 0.02 * truth[k]);
  }
  CHECK(fit.statistics.degrees_of_freedom == 2 * 501 - 9);
}

TEST_CASE("the measured arm in windows: the residuals of its record, and parts that agree",
          "[identification][measured]") {
  if (!std::filesystem::exists(kMeasured)) {
    WARN("the record is not here, nothing was tested: " << kMeasured);
    return;
  }
  // rms of its README, of another program: 9 and 7 mrad, 0.20 and 0.33 rad/s.
  const IdentificationResult fit = fitted(measured_between(0.5, 4.5));
  REQUIRE(fit.ok());
  CHECK(rms_of(fit, 0) == Approx(0.009).margin(0.001));
  CHECK(rms_of(fit, 1) == Approx(0.007).margin(0.001));
  CHECK(rms_of(fit, 2) == Approx(0.20).margin(0.01));
  CHECK(rms_of(fit, 3) == Approx(0.33).margin(0.01));
  // m2 r2 from disjoint parts: each interval holds the values of the others.
  std::vector<FittedParameter> parts;
  for (const double start : {0.5, 2.5, 4.5, 6.5})
    parts.push_back(fitted(measured_between(start, start + 2)).parameters[2]);
  for (const FittedParameter& a : parts)
    for (const FittedParameter& b : parts) {
      CHECK(a.ci95[0] < b.value);
      CHECK(b.value < a.ci95[1]);
    }
}

TEST_CASE("the measured arm with Stribeck's friction in the elbow: friction of disjoint parts agrees",
          "[identification][measured]") {
  if (!std::filesystem::exists(kMeasured)) {
    WARN("the record is not here, nothing was tested: " << kMeasured);
    return;
  }
  const auto with_stribeck = [](double start, double end, const std::string& velocity, const std::string& variable) {
    std::vector<std::string> sets = measured_between(start, end);
    sets.insert(sets.end(), {R"(parameters.rise2={"value": 0.05, "lower": 0, "upper": 2, "unit": "N m"})",
                             "forces[3].breakaway=coulomb2 + rise2", "forces[3].stribeck_velocity=" + velocity,
                             R"(identification.variables=["h1", "J1", "h2", "J2", "coulomb1", "coulomb2", "viscous1",)"
                             R"( "viscous2", "rise2")" +
                                 variable + "]"});
    return sets;
  };
  // The velocity comes from a part of the record that is not compared.
  std::vector<std::string> apart = with_stribeck(8.5, 9.99, "vs2", R"(, "vs2")");
  apart.push_back(R"(parameters.vs2={"value": 1, "lower": 0.2, "upper": 10, "scale": "log", "unit": "rad/s"})");
  const IdentificationResult of_velocity = fitted(apart);
  REQUIRE(of_velocity.ok());
  REQUIRE(of_velocity.parameters[9].name == "vs2");
  std::vector<IdentificationResult> parts;
  for (const double start : {0.5, 2.5, 4.5, 6.5}) {
    parts.push_back(fitted(with_stribeck(start, start + 2, fmt::format("{}", of_velocity.parameters[9].value), "")));
    REQUIRE(parts.back().ok());
  }
  for (const std::size_t k : {2, 4, 5}) {  // m2 r2, Coulomb friction of both joints
    for (const IdentificationResult& one : parts) {
      for (const IdentificationResult& other : parts) {
        const FittedParameter &a = one.parameters[k], &b = other.parameters[k];
        INFO(a.name << ": " << a.value << " +- " << a.std_error << ", " << b.value << " +- " << b.std_error);
        CHECK(std::abs(a.value - b.value) <= 3 * std::hypot(a.std_error, b.std_error));
        CHECK(a.ci95[0] < b.ci95[1]);
      }
    }
  }
}
