#include <catch2/catch.hpp>
#include <cmath>

#include "optim/fit/experiment.hpp"
#include "optim/fit/identification.hpp"
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

}  // namespace

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
