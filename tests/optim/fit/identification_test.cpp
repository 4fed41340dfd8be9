#include "optim/fit/identification.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <limits>

#include "optim/fit/experiment.hpp"
#include "source_folder.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Problem fit_problem(double w2, double c, double theta0, double omega0) {
  Problem p = pendulum::problem(w2, c, theta0, omega0);
  p.identification.emplace();
  p.identification->variables = {"w2", "c"};
  p.identification->experiments = {pendulum::experiment("run1", {"theta0", "omega0"})};
  return p;
}

}  // namespace

TEST_CASE("an experiment's Jacobian is that of its residuals", "[identification]") {
  Problem p = pendulum::problem(64, 0.05, 1.5, 1.8);
  testing::add_parameters(p.scene, {{"g0", 1.1}});
  testing::add_parameters(p.scene, {{"b0", 0.02}});
  ExperimentSpec spec = pendulum::experiment("run1", {});
  spec.channels[0].gain = Expression::parse("g0^2"), spec.channels[0].bias = Expression::parse("b0*w2");
  const CsvTable data = pendulum::exact_motion(60, 0.1, 1.4, 1, 2, 50);
  std::vector<Experiment::Unknown> unknowns;
  for (int k = 0; k < 6; ++k) unknowns.push_back({k, 5 - k});  // in another order
  Eigen::VectorXd u(6);
  u << 0.02, 1.1, 1.8, 1.5, 0.05, 64;
  p.scene.simulation.integrator.rtol = 1e-11, p.scene.simulation.integrator.atol = 1e-13;
  const Experiment run(p.scene, spec, "here", data, Eigen::VectorXd::Zero(6), unknowns);
  const Experiment::Residuals base = run.residuals(u);
  REQUIRE(base.ok);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double h = 1e-4 * u(k);
    Eigen::VectorXd plus = u, minus = u;
    plus(k) += h, minus(k) -= h;
    const Eigen::VectorXd difference = (run.residuals(plus).z - run.residuals(minus).z) / (2 * h);
    CHECK((base.z_u.col(k) - difference).norm() < 1e-5 * difference.norm());
  }
}

TEST_CASE("the parameters of an exact motion are found again", "[identification]") {
  const CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 5);
  const IdentificationResult result = run_identification(fit_problem(66, 0.1, 1.5, 1.4), {data});
  INFO(result.message);
  REQUIRE(result.status == SolverStatus::converged);
  REQUIRE(result.parameters.size() == 4);
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
  CHECK(result.parameters[1].value == Approx(0.055).epsilon(1e-4));
  CHECK(result.parameters[2].name == "run1.theta0");
  CHECK(result.parameters[2].value == Approx(1.53).epsilon(1e-6));
  CHECK(result.parameters[3].value == Approx(1.55).epsilon(1e-5));
  CHECK(result.parameters[0].initial == 66);
  CHECK(result.experiments[0].rms < 1e-6);
  CHECK(result.samples == 501);
  CHECK(result.simulations == result.evaluations);
  CHECK(result.statistics.unidentifiable.empty());
}

TEST_CASE("standard errors match the scatter of the estimates over noisy repetitions", "[identification]") {
  const CsvTable clean = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2, 20);
  constexpr int kRuns = 30;
  double sum = 0, squares = 0, claimed = 0;
  int covered = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    CsvTable data = clean;
    pendulum::add_noise(data, 0.02, seed + 1);
    const IdentificationResult result = run_identification(fit_problem(64, 0.055, 1.53, 1.55), {data});
    REQUIRE(result.ok());
    const FittedParameter& w2 = result.parameters[0];
    sum += w2.value, squares += w2.value * w2.value, claimed += w2.std_error / kRuns;
    covered += w2.ci95[0] <= 64 && 64 <= w2.ci95[1];
  }
  const double mean = sum / kRuns, scatter = std::sqrt((squares - kRuns * mean * mean) / (kRuns - 1));
  CHECK(scatter / claimed == Approx(1).margin(0.4));  // 3 standard deviations of the scatter of 30
  CHECK(covered >= 25);
  CHECK(std::abs(mean - 64) < 3 * claimed / std::sqrt(kRuns));
}

TEST_CASE("missing samples are skipped and counted, rows outside the experiment are left out", "[identification]") {
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 3);
  for (const std::size_t i : {3u, 4u, 100u}) data.columns[1][i] = kNaN;
  data.columns[1].back() = kNaN;
  Problem p = fit_problem(64.5, 0.06, 1.5, 1.5);
  const IdentificationResult result = run_identification(p, {data});
  CHECK(result.samples == 301 - 4);
  CHECK(result.experiments[0].channels[0].missing == 4);
  CHECK(result.experiments[0].end_time == Approx(2.99));  // the last sample that is there
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
  p.identification->experiments[0].end_time = 1;
  CHECK(run_identification(p, {data}).samples == 101 - 3);
}

TEST_CASE("several experiments share parameters, own others, and override", "[identification]") {
  Problem p = fit_problem(65, 0.05, 1.5, 1.5);
  p.identification->experiments.push_back(pendulum::experiment("run2", {"theta0"}));
  p.identification->experiments[1].overrides = {{"omega0", -0.5}, {"theta0", 2}};
  p.identification->experiments.push_back(pendulum::experiment("run3", {"theta0", "omega0"}));
  p.identification->experiments[2].validate = true;
  p.identification->experiments[2].overrides = {{"theta0", 2.5}};
  const CsvTable one = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  const CsvTable two = pendulum::exact_motion(64, 0.055, 2.1, -0.5, 2);
  CsvTable three = pendulum::exact_motion(64, 0.055, 2.4, 1, 2);
  pendulum::add_noise(three, 0.01, 5);
  const IdentificationResult result = run_identification(p, {one, two, three});
  REQUIRE(result.ok());
  REQUIRE(result.parameters.size() == 5);
  CHECK(result.parameters[4].name == "run2.theta0");
  CHECK(result.parameters[4].initial == 2);
  CHECK(result.parameters[4].value == Approx(2.1).epsilon(1e-6));
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
  const ExperimentFit& validation = result.experiments[2];
  CHECK(validation.validate);
  REQUIRE(validation.refitted.size() == 2);
  CHECK(validation.refitted[0].name == "run3.theta0");
  CHECK(validation.refitted[0].value == Approx(2.4).epsilon(0.005));
  CHECK(validation.refitted[1].value == Approx(1).epsilon(0.05));
  CHECK(validation.rms == Approx(0.01).epsilon(0.15));
  CHECK(result.experiments[0].rms < 1e-6);
  CHECK(result.residuals.size() == 3 * 201);
  CHECK(result.residuals.back().experiment == 2);
  CHECK(result.samples == 2 * 201);
}

TEST_CASE("standard errors of what validates hold those of the shared parameters", "[identification]") {
  const CsvTable clean = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2, 20),
                 other = pendulum::exact_motion(64, 0.055, 2.1, 0, 2, 20);
  Problem p = fit_problem(64, 0.055, 1.53, 1.55);
  p.identification->experiments.push_back(pendulum::experiment("other", {"theta0", "omega0"}));
  p.identification->experiments[1].validate = true;
  p.identification->experiments[1].overrides = {{"theta0", 2.1}, {"omega0", 0}};
  constexpr int kRuns = 30;
  double squares = 0, claimed = 0;
  for (unsigned seed = 0; seed < kRuns; ++seed) {  // the other record has a tenth of the noise
    std::vector<CsvTable> data{clean, other};
    pendulum::add_noise(data[0], 0.02, seed + 1), pendulum::add_noise(data[1], 0.002, seed + 1001);
    const IdentificationResult result = run_identification(p, data);
    REQUIRE(result.ok());
    const FittedParameter& omega0 = result.experiments[1].refitted.at(1);
    squares += omega0.value * omega0.value / kRuns, claimed += omega0.std_error / kRuns;
    CHECK(omega0.ci95[1] - omega0.value == Approx(omega0.value - omega0.ci95[0]));
    CHECK(omega0.ci95[1] > omega0.value + 1.9 * omega0.std_error);
  }
  CHECK(std::sqrt(squares) / claimed == Approx(1).margin(0.4));  // 3 standard deviations of the scatter of 30
}

TEST_CASE("what validates is predicted with its measurements", "[identification]") {
  Problem p = fit_problem(60, 0.1, 1.5, 1.5);
  p.identification->experiments.push_back(pendulum::experiment("other", {"theta0", "omega0"}));
  ExperimentSpec& other = p.identification->experiments[1];
  other.validate = true, other.overrides = {{"theta0", 2.3}};
  CsvTable fitted = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 4);
  pendulum::add_noise(fitted, 0.01, 1);
  for (const bool same : {true, false}) {
    CsvTable second = pendulum::exact_motion(same ? 64 : 60, same ? 0.055 : 0.1, 2.4, 1, 4);
    pendulum::add_noise(second, 0.01, 2);
    const IdentificationResult result = run_identification(p, {fitted, second});
    REQUIRE(result.ok());
    const ExperimentFit& validation = result.experiments[1];
    // 95 % of 401 measurements, to three standard deviations of that share.
    CHECK(result.experiments[0].channels[0].within_prediction == Approx(0.95).margin(0.033));
    if (same) CHECK(validation.channels[0].within_prediction == Approx(0.95).margin(0.033));
    // A measurement is known to its noise, and a little less to the model; a refit of a wrong model knows less.
    for (const ResidualRow& row : result.residuals) {
      if (!same && row.experiment == 1) continue;
      CHECK(row.prediction > 0.018);
      CHECK(row.prediction < 0.024);
    }
  }
}

TEST_CASE("what a motion cannot tell is named", "[identification]") {
  Problem p = fit_problem(64, 0.055, 1.53, 1.55);
  testing::add_parameters(p.scene, {{"m_arm", 0.5}});
  testing::add_parameters(p.scene, {{"m_load", 0.5}});
  p.scene.bodies[0].mass = Expression::parse("m_arm + m_load");  // the inertia about the centre of mass is not theirs
  p.identification->variables = {"m_arm", "m_load", "c"};
  const CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  const IdentificationResult result = run_identification(p, {data});
  CHECK(result.statistics.unidentifiable ==
        std::vector<std::string>{"m_arm, m_load: only m_arm + m_load is determined"});
  CHECK(std::isinf(result.parameters[0].std_error));
  CHECK(std::isfinite(result.parameters[2].std_error));
  CHECK(result.statistics.condition_number > 1e8);
}

TEST_CASE("of mass, lever, inertia and friction a free swing tells two combinations", "[identification]") {
  // theta'' = (m g a/J) sin theta - (k/J) theta'
  Problem p = fit_problem(64, 0.055, 1.53, 1.55);
  for (const auto& [name, value] : {std::pair("m", 0.5), std::pair("a", 0.1), std::pair("k", 4e-4)})
    testing::add_parameters(p.scene, {{name, value}});
  testing::add_parameters(p.scene, {{"J0", 0.5 * 9.81 * 0.1 / 64}});
  p.scene.bodies[0].mass = Expression::parse("m");
  p.scene.bodies[0].com = {0.0, Expression::parse("a"), 0.0};
  p.scene.bodies[0].inertia.zz = Expression::parse("J0 - m*a^2");
  std::get<Rsda>(p.scene.forces[0].kind).damping = Expression::parse("k");
  p.identification->variables = {"m", "a", "k", "J0"};
  const IdentificationResult result = run_identification(p, {pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2)});
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(result.statistics.unidentifiable ==
        std::vector<std::string>{"m, a, k, J0: only m*a/J0 and k/J0 are determined"});
  for (int k = 0; k < 4; ++k) CHECK(std::isinf(result.parameters[static_cast<std::size_t>(k)].std_error));
  CHECK(std::isfinite(result.parameters[4].std_error));  // theta0
  const auto value = [&](std::size_t i) { return result.parameters[i].value; };
  CHECK(value(0) * 9.81 * value(1) / value(3) == Approx(64).epsilon(1e-6));
  CHECK(value(2) / value(3) == Approx(0.055).epsilon(1e-4));
}

TEST_CASE("gain and bias may be fitted, sigma may not", "[identification]") {
  Problem p = fit_problem(64.5, 0.05, 1.5, 1.5);
  testing::add_parameters(p.scene, {{"offset", 0}});
  p.identification->variables.push_back("offset");
  p.identification->experiments[0].channels[0].bias = Expression::parse("offset");
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 4);
  for (double& x : data.columns[1]) x += 0.125;
  const IdentificationResult result = run_identification(p, {data});
  REQUIRE(result.ok());
  CHECK(result.parameters[2].value == Approx(0.125).epsilon(1e-5));
  p.identification->experiments[0].channels[0].sigma = Expression::parse("0.01 + offset");
  CHECK_THROWS_WITH(run_identification(p, {data}),
                    Contains("identification.experiments[0].channels[0].sigma: depends on 'offset'"));
}

TEST_CASE("identifications that make no sense are refused with the place", "[identification]") {
  const CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 1);
  Problem p = fit_problem(64, 0.05, 1.5, 1.5);
  auto refusal = [&] {
    try {
      run_identification(p, {data});
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  ExperimentSpec& e = p.identification->experiments[0];
  e.channels[0].column = "thetta";
  CHECK_THAT(refusal(), Contains("has no column 'thetta' (did you mean 'theta'?)"));
  e.channels[0].column = "theta", e.channels[0].sensor = "thet";
  CHECK_THAT(refusal(), Contains("channels[0].sensor: there is no sensor 'thet' (did you mean 'theta'?)"));
  e.channels[0].sensor = "theta", e.channels[0].sigma = 0.0;
  CHECK_THAT(refusal(), Contains("channels[0].sigma: is 0, must be above 0"));
  e.channels[0].sigma = 1.0, e.start_time = 5;
  CHECK_THAT(refusal(), Contains("no sample after the start at 5 s; its times run from 0 to 1 s"));
  e.start_time.reset(), p.identification->variables = {"w3"};
  CHECK_THAT(refusal(), Contains("there is no parameter 'w3'"));
  p.identification->variables = {"theta0"};
  CHECK_THAT(refusal(), Contains("'theta0' is free or overridden in every fitted experiment"));
  e.validate = true;
  CHECK_THAT(refusal(), Contains("all of them validate"));
}

TEST_CASE("the measured pendulum: the published figures of the record", "[identification]") {
  const std::string path =
      MBSOPT_SOURCE_DIR "/../shared/data/measured/multiarm_single_pendulum/single_pendulum_1kHz.csv";
  if (!std::filesystem::exists(path)) {
    WARN("the record is not here, nothing was tested: " << path);
    return;
  }
  const CsvTable data = read_csv(path);
  Problem p = fit_problem(66, 0.06, 1.52, 1.85);  // 3 % off; the first sample and rate of the record
  p.scene.simulation.integrator.rtol = 1e-7, p.scene.simulation.integrator.atol = 1e-9;
  ExperimentSpec& fit = p.identification->experiments[0];
  fit.time = "t_s", fit.channels[0].column = "theta_rad", fit.end_time = 36.667;
  ExperimentSpec check = fit;
  check.name = "validation", check.validate = true, check.start_time = 36.668, check.end_time.reset();
  check.overrides = {{"theta0", 3.5}, {"omega0", -2.5}};
  p.identification->experiments.push_back(check);
  const IdentificationResult result = run_identification(p, {data, data});
  INFO(result.message);
  REQUIRE(result.ok());
  const FittedParameter &w2 = result.parameters[0], &c = result.parameters[1];
  CHECK(w2.value == Approx(64.00084).margin(5e-5));
  CHECK(c.value == Approx(0.054697).margin(1e-6));
  CHECK(result.experiments[0].samples == 36668);
  CHECK(result.experiments[0].rms == Approx(0.0095).margin(5e-5));
  CHECK(result.experiments[1].samples == 18333);
  CHECK(result.experiments[1].rms == Approx(0.0266).margin(5e-5));
  // The residuals are correlated over seconds: the error of the model, which independent residuals would make 0.001.
  CHECK(result.statistics.covariance_type == CovarianceType::newey_west);
  CHECK(w2.std_error > 0.01);
  CHECK(w2.std_error < 0.05);
  WARN("m g a/J = " << w2.value << " +- " << w2.std_error << ", k/J = " << c.value << " +- " << c.std_error << ", rms "
                    << result.experiments[0].rms << ", validation " << result.experiments[1].rms << ", "
                    << result.evaluations << " evaluations, " << result.wall_seconds << " s");
}

TEST_CASE("a variable whose bounds are one number is a constant, and a warning says so", "[identification]") {
  Problem p = fit_problem(64, 0.1, 1.53, 1.55);
  p.scene.parameters[0].lower = p.scene.parameters[0].upper = 64;
  const CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  const IdentificationResult result = run_identification(p, {data});
  INFO(result.message);
  REQUIRE(result.ok());
  REQUIRE(result.parameters.size() == 3);
  CHECK(result.parameters[0].name == "c");
  CHECK(result.parameters[0].value == Approx(0.055).epsilon(1e-4));
  REQUIRE(result.warnings.size() == 1);
  CHECK_THAT(result.warnings[0], Contains("parameters.w2.lower: is 64, as is the upper bound"));
  p.identification->variables = {"w2"}, p.identification->experiments[0].free.clear();
  CHECK_THROWS_WITH(run_identification(p, {data}), Contains("identification.variables: none of them can change"));
}

TEST_CASE("a fit that was stopped has no standard errors, and no estimated sigma", "[identification]") {
  Problem p = fit_problem(66, 0.1, 1.5, 1.4);
  p.identification->experiments[0].channels[0].estimate_sigma = SigmaEstimate::own;
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  pendulum::add_noise(data, 0.01, 1);
  IdentificationOptions options;
  options.progress = [](const FitRow& row) { return row.iteration < 1; };
  const IdentificationResult result = run_identification(p, {data}, options);
  REQUIRE(result.status == SolverStatus::stopped);
  for (const FittedParameter& fitted : result.parameters) {
    CHECK(std::isnan(fitted.std_error));
    CHECK(std::isnan(fitted.ci95[0]));
  }
  CHECK_THAT(result.statistics.none, Contains("ended before"));
  CHECK_FALSE(result.experiments[0].channels[0].sigma_is_estimated);
  REQUIRE_FALSE(result.warnings.empty());
  CHECK_THAT(result.warnings[0], Contains("before the sigmas were estimated"));
}

TEST_CASE("a fit that ends without progress has standard errors, and a warning", "[identification]") {
  Problem p = fit_problem(60, 0.055, 1.53, 1.55);
  p.identification->variables = {"w2"}, p.identification->experiments[0].free.clear();
  p.identification->experiments[0].channels[0].bias = Expression::parse("1e-9*sqrt(62 - w2)");  // ends at 62
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  pendulum::add_noise(data, 0.01, 1);
  const IdentificationResult result = run_identification(p, {data});
  INFO(result.message);
  REQUIRE(result.status == SolverStatus::no_progress);
  CHECK(result.parameters[0].value <= 62);
  CHECK(std::isfinite(result.parameters[0].std_error));
  CHECK(result.statistics.none.empty());
  REQUIRE_FALSE(result.warnings.empty());
  CHECK_THAT(result.warnings[0], Contains("standard errors and intervals hold at a minimum"));
}

TEST_CASE("a fit that reached its iteration limit has no standard errors", "[identification]") {
  Problem p = fit_problem(66, 0.1, 1.5, 1.4);
  p.identification->max_iterations = 1;
  const IdentificationResult result = run_identification(p, {pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2)});
  REQUIRE(result.status == SolverStatus::iteration_limit);
  CHECK(std::isnan(result.parameters[0].std_error));
  CHECK_THAT(result.statistics.none, Contains("ended before"));
}

TEST_CASE("a record of angles in degrees is questioned", "[identification]") {
  Problem p = fit_problem(64, 0.055, 1.53, 1.55);
  p.identification->experiments[0].free.clear();
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  CHECK(run_identification(p, {data}).warnings.empty());
  for (double& x : data.columns[1]) x *= 180 / 3.14159265358979;
  const IdentificationResult result = run_identification(p, {data});
  REQUIRE_FALSE(result.warnings.empty());
  CHECK_THAT(result.warnings.back(),
             Contains("identification.experiments[0].channels[0].column: ") && Contains("in degrees?"));
  const auto warnings_of = [](const Problem& problem, const CsvTable& table) {
    return fmt::format("{}", fmt::join(run_identification(problem, {table}).warnings, "\n"));
  };
  Problem stated = p;  // who states a unit is not asked
  stated.identification->experiments[0].channels[0].unit = "rad";
  CHECK_THAT(warnings_of(stated, data), !Contains("in degrees?") && Contains("the fit explains nothing of"));
  CsvTable named = data;
  named.header[1] += " [rad]";
  CHECK_THAT(warnings_of(p, named), !Contains("in degrees?"));
  p.identification->experiments[0].channels[0].gain = 180 / 3.14159265358979;
  p.identification->experiments[0].channels[0].sigma = 0.5;
  CHECK(run_identification(p, {data}).warnings.empty());
}

TEST_CASE("a delay longer than the record is refused at the delay", "[identification]") {
  Problem p = fit_problem(64, 0.05, 1.5, 1.5);
  p.identification->experiments[0].channels[0].delay = 5.0;
  CHECK_THROWS_WITH(run_identification(p, {pendulum::exact_motion(64, 0.055, 1.53, 1.55, 1)}),
                    Contains("identification.experiments[0].channels[0].delay: is up to 5 s"));
}
