#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/fit/experiment.hpp"
#include "optim/fit/identification.hpp"
#include "optim/objective/expression_cost.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;
using Catch::Matchers::Contains;

namespace {

// The pendulum's start is known; what its sensor shows is late by tau.
Problem late_problem(double tau) {
  Problem p = pendulum::problem(64, 0.055, 1.53, 1.55);
  testing::add_parameters(p.scene, {{"tau", tau}});
  p.scene.parameters[4].lower = -0.1, p.scene.parameters[4].upper = 0.1;
  p.identification.emplace();
  p.identification->variables = {"w2", "tau"};
  p.identification->experiments = {pendulum::experiment("run1", {})};
  p.identification->experiments[0].channels[0].delay = Expression::parse("tau");
  return p;
}

// The exact motion as a sensor shows it that is late by so many milliseconds: t shifted, rows before the start left
// out.
CsvTable late_motion(int milliseconds, double end = 3) {
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, end);
  for (double& t : data.columns[0]) t += 1e-3 * milliseconds;
  return data;
}

Experiment experiment(const Problem& p, const CsvTable& data) {
  Eigen::VectorXd rho(5);
  for (Eigen::Index k = 0; k < 5; ++k) rho(k) = p.scene.parameters[static_cast<std::size_t>(k)].value;
  return Experiment(p.scene, p.identification->experiments[0], "here", data, rho,
                    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}});
}

// theta of the encoder, and the rate of a gyroscope whose reading drifts and whose clock is fast.
Problem drifting_problem() {
  Problem p = pendulum::problem(62, 0.06, 1.5, 1.6);
  testing::add_parameters(p.scene, {{"late", 0.0}, {"fast", 0.0}, {"offset", 0.0}, {"drift", 0.0}});
  p.scene.parameters[4].upper = 0.1;
  Sensor rate = testing::angle_sensor("omega", "pin");
  rate.quantity = "rate";
  p.scene.sensors.push_back(rate);
  p.identification.emplace();
  p.identification->variables = {"w2", "c", "late", "fast", "offset", "drift"};
  ExperimentSpec run = pendulum::experiment("run1", {"theta0", "omega0"});
  ChannelSpec gyroscope;
  gyroscope.column = "omega", gyroscope.sensor = "omega", gyroscope.sigma = 0.05;
  gyroscope.bias = Expression::parse("offset + drift*t"), gyroscope.delay = Expression::parse("late + fast*t");
  run.channels.push_back(gyroscope);
  p.identification->experiments = {run};
  return p;
}

constexpr double kLate = 0.0312, kFast = 0.002, kOffset = 0.1, kDrift = -0.02;

// The exact motion of 4 s as both instruments show it, each at times of its own.
CsvTable drifting_record() {
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 4);
  const CsvTable fine = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 4, 1);
  const double nan = std::nan("");
  struct Row {
    double t, theta, omega;
  };
  std::vector<Row> rows;
  for (std::size_t i = 0; i < data.columns[0].size(); ++i)
    rows.push_back({data.columns[0][i], data.columns[1][i], nan});
  const std::vector<double>& theta = fine.columns[1];
  for (std::size_t i = 2; i + 2 < theta.size(); i += 10) {  // differences of fourth order: 1e-8 rad/s
    const double omega = (8 * (theta[i + 1] - theta[i - 1]) - theta[i + 2] + theta[i - 2]) / 0.012;
    const double stamp = (fine.columns[0][i] + kLate) / (1 - kFast);
    rows.push_back({stamp, nan, omega + kOffset + kDrift * stamp});
  }
  std::ranges::sort(rows, {}, &Row::t);
  data.header.push_back("omega"), data.columns.assign(3, {}), data.lines.clear();
  for (const Row& row : rows) {
    data.columns[0].push_back(row.t), data.columns[1].push_back(row.theta), data.columns[2].push_back(row.omega);
    data.lines.push_back(data.lines.size() + 2);
  }
  return data;
}

}  // namespace

TEST_CASE("the drift and the clock of a sensor are found again", "[identification][delay]") {
  const IdentificationResult result = run_identification(drifting_problem(), {drifting_record()});
  INFO(result.message);
  REQUIRE(result.ok());
  const auto value = [&](std::size_t i) { return result.parameters[i].value; };
  CHECK(value(0) == Approx(64).epsilon(1e-6));
  CHECK(value(1) == Approx(0.055).epsilon(1e-4));
  CHECK(value(2) == Approx(kLate).margin(1e-7));
  CHECK(value(3) == Approx(kFast).margin(1e-7));
  CHECK(value(4) == Approx(kOffset).margin(1e-5));
  CHECK(value(5) == Approx(kDrift).margin(1e-5));
  CHECK(result.statistics.unidentifiable.empty());
}

TEST_CASE("bias and delay of t: tangent-linear model, adjoint and differences agree", "[identification][delay]") {
  Problem p = drifting_problem();
  p.scene.simulation.integrator.rtol = 1e-11, p.scene.simulation.integrator.atol = 1e-13;
  Eigen::VectorXd u(8);
  u << 62, 0.06, 1.5, 1.6, 0.02, 0.003, 0.07, -0.01;
  std::vector<Experiment::Unknown> unknowns;
  for (int k = 0; k < 8; ++k) unknowns.push_back({k, k});
  const Experiment run(p.scene, p.identification->experiments[0], "here", drifting_record(), u, unknowns);
  const Experiment::Residuals base = run.residuals(u);
  REQUIRE(base.ok);

  // psi = sum of w_i z_i, weights of either sign.
  Eigen::VectorXd weights(base.z.size());
  for (Eigen::Index i = 0; i < weights.size(); ++i) weights(i) = std::cos(1.7 * static_cast<double>(i));
  const Eigen::VectorXd tangent = base.z_u.transpose() * weights;
  for (Eigen::Index k = 0; k < 8; ++k) {
    const double h = 1e-4 * u(k);
    Eigen::VectorXd plus = u, minus = u;
    plus(k) += h, minus(k) -= h;
    const double difference = (run.residuals(plus).z - run.residuals(minus).z).dot(weights) / (2 * h);
    INFO("parameter " << k);
    CHECK(tangent(k) == Approx(difference).epsilon(1e-4));
  }

  // By the adjoint: psi is a sum of readings s(t - delay), each with its weight. A delay moves the instant of a reading
  // of the rate, whose own rate is theta'' = w2 sin(theta) - c theta'. A bias is added.
  const Scene scene = run.simulated();
  const Mechanism mechanism(scene, u);
  const auto expression = [&](const std::string& text) {
    return CostExpression(Expression::parse(text), scene).bind(mechanism);
  };
  Cost cost;
  Sampling readings;
  std::vector<double> factors, stamps;
  for (std::size_t i = 0; i < run.samples().size(); ++i) {
    const Experiment::Sample& sample = run.samples()[i];
    const bool gyroscope = sample.channel == 1;
    const double t = run.times()[sample.time],
                 factor = -weights(static_cast<Eigen::Index>(i)) / run.sigma(sample.channel);
    const double instant = gyroscope ? t - u(4) - u(5) * t : t;
    cost.samples.push_back({instant, expression(fmt::format("{:.17g}*{}", factor, gyroscope ? "omega" : "theta"))});
    if (gyroscope) readings.times.push_back(instant), factors.push_back(factor), stamps.push_back(t);
  }
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, std::vector<Cost>{cost});
  REQUIRE(adjoint.ok());
  Eigen::VectorXd by_adjoint = adjoint.psi_rho.row(0);
  const auto theta = expression("theta"), omega = expression("omega");
  readings.observe = [&](std::size_t i, const StatePoint& at) {
    const double acceleration = u(0) * std::sin(theta->value(at)) - u(1) * omega->value(at);
    by_adjoint(4) -= factors[i] * acceleration, by_adjoint(5) -= factors[i] * acceleration * stamps[i];
    by_adjoint(6) += factors[i], by_adjoint(7) += factors[i] * stamps[i];
  };
  REQUIRE(simulate(mechanism, scene.simulation, {}, readings).ok());
  for (Eigen::Index k = 0; k < 8; ++k) {
    INFO("parameter " << k);
    CHECK(tangent(k) == Approx(by_adjoint(k)).epsilon(1e-7));
  }
}

TEST_CASE("the delay of a sensor is found again, positive and negative", "[identification][delay]") {
  for (const int milliseconds : {37, -23}) {
    const IdentificationResult result = run_identification(late_problem(0.0), {late_motion(milliseconds)});
    INFO(result.message);
    REQUIRE(result.ok());
    CHECK(result.parameters[0].value == Approx(64).epsilon(1e-6));
    CHECK(result.parameters[1].value == Approx(1e-3 * milliseconds).margin(1e-7));
    CHECK(result.experiments[0].rms < 1e-6);
  }
}

TEST_CASE("the derivative in the delay is that of the residuals", "[identification][delay]") {
  const char* integrator = GENERATE("dopri5", "radau5", "cvodes_adams");
  Problem p = late_problem(0.0123);
  p.scene.simulation.integrator.type = integrator;
  p.scene.simulation.integrator.rtol = 1e-11, p.scene.simulation.integrator.atol = 1e-13;
  p.identification->experiments[0].channels[0].delay = Expression::parse("tau*sqrt(c/0.055)");
  p.identification->experiments[0].channels[0].gain = 1.3;
  const Experiment run = experiment(p, late_motion(20, 1));
  Eigen::VectorXd u(5);
  u << 62, 0.06, 1.5, 1.6, 0.0123;
  const Experiment::Residuals base = run.residuals(u);
  REQUIRE(base.ok);
  for (const Eigen::Index k : {0, 1, 4}) {
    const double h = 1e-4 * u(k);
    Eigen::VectorXd plus = u, minus = u;
    plus(k) += h, minus(k) -= h;
    const Eigen::VectorXd difference = (run.residuals(plus).z - run.residuals(minus).z) / (2 * h);
    INFO(integrator << ", parameter " << k);
    CHECK((base.z_u.col(k) - difference).norm() < 1e-5 * difference.norm());
    CHECK(difference.norm() > 1);
  }
}

TEST_CASE("the derivative in the delay is that of the dense output, however coarse the steps",
          "[identification][delay]") {
  // Fixed steps of 50 ms: the sensor's rate of change along the dense output is far from the exact motion's.
  Problem p = late_problem(0.0123);
  p.scene.simulation.integrator = {};
  p.scene.simulation.integrator.type = "dopri5", p.scene.simulation.integrator.step = 0.05;
  const Experiment run = experiment(p, late_motion(20, 1));
  Eigen::VectorXd u(5);
  u << 64, 0.055, 1.53, 1.55, 0.0123;
  const Experiment::Residuals base = run.residuals(u);
  REQUIRE(base.ok);
  constexpr double h = 1e-6;
  Eigen::VectorXd plus = u, minus = u;
  plus(4) += h, minus(4) -= h;
  const Eigen::VectorXd difference = (run.residuals(plus).z - run.residuals(minus).z) / (2 * h);
  CHECK((base.z_u.col(4) - difference).norm() < 1e-7 * difference.norm());
}

TEST_CASE("rows that a delay could take before the start are left out", "[identification][delay]") {
  const Problem p = late_problem(0.0);  // up to 0.1 s
  const CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 1);
  const Experiment run = experiment(p, data);
  CHECK(run.samples().size() == 91);
  CHECK(run.times()[run.samples()[0].time] == Approx(0.1));
  Problem unbounded = p;
  unbounded.scene.parameters[4].lower.reset(), unbounded.scene.parameters[4].upper.reset();
  const Experiment all = experiment(unbounded, data);
  CHECK(all.samples().size() == 101);
  // There the mechanism stays as it is at the start.
  Eigen::VectorXd u(5);
  u << 64, 0.055, 1.53, 1.55, 0.2;
  const Experiment::Residuals r = all.residuals(u);
  REQUIRE(r.ok);
  CHECK(r.z(5) == Approx((data.columns[1][5] - 1.53) / 0.01));
  CHECK(r.z_u(5, 4) == 0);
  CHECK(r.z_u(25, 4) != 0);
}

TEST_CASE("two channels of one sensor, one late: their difference is the delay", "[identification][delay]") {
  // With the start fitted as well a common delay would be lost in it; the channel without one holds the clock.
  Problem p = late_problem(0.01);
  ExperimentSpec& run = p.identification->experiments[0];
  run.free = {"theta0", "omega0"};
  run.channels.push_back(run.channels[0]);
  run.channels[1].column = "late";
  run.channels[0].delay = 0.0;
  CsvTable data = pendulum::exact_motion(64, 0.055, 1.53, 1.55, 2);
  data.header.push_back("late");
  data.columns.emplace_back(data.columns[1].size(), 1.53);
  for (std::size_t i = 4; i < data.columns[1].size(); ++i) data.columns[2][i] = data.columns[1][i - 4];
  const IdentificationResult result = run_identification(p, {data});
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(result.parameters[1].value == Approx(0.04).margin(1e-7));
  CHECK(result.statistics.unidentifiable.empty());

  // That a late clock and an early start are the same holds as far as the integration is exact, which is taken into
  // account.
  run.channels.erase(run.channels.begin());
  p.scene.simulation.integrator.rtol = GENERATE(1e-6, 1e-8, 1e-12);
  p.scene.simulation.integrator.atol = 0.01 * p.scene.simulation.integrator.rtol;
  const IdentificationResult alone = run_identification(p, {data});
  REQUIRE(alone.statistics.unidentifiable.size() == 1);
  CHECK_THAT(alone.statistics.unidentifiable.at(0), Contains("tau") && Contains("theta0") && Contains("determined"));
}

TEST_CASE("a fitted delay of an acceleration is refused where time acts on the model by itself",
          "[identification][delay]") {
  Problem p = late_problem(0.0);
  Sensor pull = testing::point_sensor("pull", "acceleration", "arm", testing::vec("0", "0.01", "0"), "x");
  p.scene.sensors.push_back(pull);
  p.identification->experiments[0].channels[0].sensor = "pull";
  const CsvTable data = late_motion(0, 1);
  const Experiment run = experiment(p, data);  // nothing depends on time here
  Eigen::VectorXd u(5);
  u << 64, 0.055, 1.53, 1.55, 0.02;
  const Experiment::Residuals base = run.residuals(u);
  REQUIRE(base.ok);
  Eigen::VectorXd plus = u, minus = u;
  plus(4) += 1e-6, minus(4) -= 1e-6;
  const Eigen::VectorXd difference = (run.residuals(plus).z - run.residuals(minus).z) / 2e-6;
  CHECK((base.z_u.col(4) - difference).norm() < 1e-6 * difference.norm());

  Torque motor;
  motor.body = "arm", motor.components = {0.0, 0.0, Expression::parse("1e-3*sin(t)")};
  p.scene.forces.push_back({"motor", motor});
  CHECK_THROWS_WITH(experiment(p, data), Contains("here.channels[0].delay: depends on 'tau', which is fitted") &&
                                             Contains("quantity 'acceleration'"));
}

TEST_CASE("a known delay holds in an experiment that only validates", "[identification][delay]") {
  const char* integrator = GENERATE("dopri5", "cvodes_adams");
  Problem p = late_problem(0.03);
  p.scene.simulation.integrator.type = integrator;
  p.scene.parameters[4].lower.reset(), p.scene.parameters[4].upper.reset();
  p.identification->variables = {"w2"};
  p.identification->experiments.push_back(p.identification->experiments[0]);
  p.identification->experiments[1].name = "again", p.identification->experiments[1].validate = true;
  const IdentificationResult result = run_identification(p, {late_motion(30), late_motion(30)});
  REQUIRE(result.ok());
  CHECK(result.parameters[0].value == Approx(64).epsilon(1e-5));
  CHECK(result.experiments[1].samples == 301);
  CHECK(result.experiments[1].rms < 1e-5);
}
