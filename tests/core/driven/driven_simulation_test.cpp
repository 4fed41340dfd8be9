// Driven mechanisms are solved: closed forms, the integrated motion, TLM, adjoint and differences agree.
#include "core/driven/driven_simulation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Scene with_motor(Scene s, const std::string& law) {
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "A", motor.law = f(law);
  s.drives.push_back(motor);
  return s;
}

// Slider-crank in x-y, its slider of mass m along x.
Scene slider_crank() {
  Scene s;
  add_parameters(s, {{"r", 0.2}, {"l", 0.7}, {"m", 2.0}, {"w", 5.0}});
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 0.1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.bodies.push_back(plain_body("rod", 0.1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("r", "0", "0")));
  s.bodies.push_back(plain_body("slider", 2, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("r + l", "0", "0")));
  s.bodies.back().mass = f("m");
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", vec("r", "0", "0"), "rod", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "rod", vec("l", "0", "0"), "slider", vec("0", "0", "0")));
  Joint guide;
  guide.name = "guide", guide.type = "translational", guide.body2 = "slider";
  guide.axis1 = vec("1", "0", "0"), guide.axis2 = vec("1", "0", "0");
  s.joints.push_back(guide);
  s.sensors.push_back(point_sensor("x", "position", "slider", vec("0", "0", "0"), "x"));
  s.sensors.push_back(point_sensor("v", "velocity", "slider", vec("0", "0", "0"), "x"));
  s.sensors.push_back(point_sensor("a", "acceleration", "slider", vec("0", "0", "0"), "x"));
  Sensor torque;
  torque.name = "torque", torque.quantity = "drive_force", torque.drive = "motor";
  s = with_motor(std::move(s), "w*t");
  s.sensors.push_back(torque);
  s.sensors.push_back(angle_sensor("theta", "A"));
  s.simulation.end_time = 2;
  IntegratorSettings& integrator = s.simulation.integrator;
  integrator.type = "dopri853", integrator.rtol = 1e-11, integrator.atol = 1e-13;
  return s;
}

// Integrals of x^2 and of torque^2, samples, x v at the end.
std::vector<Cost> costs_of(const Mechanism& m) {
  const int x = m.sensor("x"), v = m.sensor("v"), torque = m.sensor("torque"), theta = m.sensor("theta");
  std::vector<Cost> costs(3);
  costs[0].running = std::make_shared<SensorProduct>(m, x, x);
  costs[0].terminal = std::make_shared<SensorProduct>(m, x, v);
  costs[1].running = std::make_shared<SensorProduct>(m, torque, torque);
  costs[2].samples = {{0.0, std::make_shared<SensorProduct>(m, x, v)},
                      {0.7, std::make_shared<SensorProduct>(m, theta, x)},
                      {2.0, std::make_shared<SensorProduct>(m, torque, x)}};
  return costs;
}

double slider_x(const VectorXd& rho, double t) {
  const double th = rho(3) * t, s = rho(0) * std::sin(th);
  return rho(0) * std::cos(th) + std::sqrt(rho(1) * rho(1) - s * s);
}

}  // namespace

TEST_CASE("a driven slider-crank is solved, and equals its closed form", "[driven]") {
  const Scene scene = slider_crank();
  const VectorXd rho = nominal(scene);
  const Mechanism m(scene, rho);
  const std::vector<Cost> costs = costs_of(m);
  const SimulationResult run = simulate(m, scene.simulation, costs);
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK(run.statistics.solved);
  CHECK(run.statistics.max_position_violation < 1e-13);
  double x2 = 0;  // Simpson's rule
  constexpr int n = 20000;
  for (int i = 0; i <= n; ++i) {
    const double w = i == 0 || i == n ? 1 : i % 2 == 1 ? 4 : 2;
    x2 += w * std::pow(slider_x(rho, 2.0 * i / n), 2) * 2.0 / n / 3;
  }
  const double h = 1e-5, v_end = (slider_x(rho, 2 + h) - slider_x(rho, 2 - h)) / (2 * h);
  CHECK(run.psi(0) == Approx(x2 + slider_x(rho, 2) * v_end).epsilon(1e-9));
}

TEST_CASE("solved and integrated runs agree, values and gradients", "[driven]") {
  Scene scene = slider_crank();
  const Mechanism m(scene, nominal(scene));
  const std::vector<Cost> costs = costs_of(m);
  const SimulationResult solved = simulate_adjoint(m, scene.simulation, costs);
  scene.simulation.solve = Solve::dynamics;
  const SimulationResult integrated = simulate_adjoint(m, scene.simulation, costs);
  REQUIRE(solved.ok());
  REQUIRE(integrated.ok());
  CHECK(solved.statistics.solved);
  CHECK_FALSE(integrated.statistics.solved);
  for (Eigen::Index o = 0; o < solved.psi.size(); ++o) {
    CHECK(solved.psi(o) == Approx(integrated.psi(o)).epsilon(1e-8));
    for (Eigen::Index k = 0; k < solved.psi_rho.cols(); ++k)
      CHECK(solved.psi_rho(o, k) == Approx(integrated.psi_rho(o, k)).epsilon(1e-7).margin(1e-9));
  }
}

TEST_CASE("solved: TLM equals adjoint, and differences on the same panels", "[driven]") {
  const Scene scene = GENERATE(true, false) ? slider_crank() : [] {
    Scene s = with_motor(every_force_four_bar(), "0.3*sin(2*t) + 0.1*t");
    Joint keeps_turn;  // of the coupler about its own axis
    keeps_turn.name = "P", keeps_turn.type = "perpendicular", keeps_turn.body1 = "coupler", keeps_turn.body2 = "rocker";
    keeps_turn.axis1 = vec("0", "1", "0"), keeps_turn.axis2 = vec("1", "0", "0.3");
    s.joints.push_back(keeps_turn);
    s.sensors.push_back(point_sensor("x", "position", "rocker", vec("L3", "0", "0"), "x"));
    Sensor torque;
    torque.name = "torque", torque.quantity = "drive_force", torque.drive = "motor";
    s.sensors.push_back(torque);
    s.sensors.push_back(angle_sensor("theta", "A"));
    s.simulation.end_time = 2;
    return s;
  }();
  const VectorXd rho = nominal(scene);
  const Mechanism m(scene, rho);
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, costs_of(m));
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, costs_of(m));
  INFO(tlm.message << adjoint.message);
  REQUIRE(tlm.ok());
  REQUIRE(adjoint.ok());
  REQUIRE(tlm.statistics.solved);
  CHECK((tlm.psi - adjoint.psi).norm() == 0);
  const MatrixXd size = tlm.psi_rho.cwiseAbs().rowwise().maxCoeff().replicate(1, tlm.psi_rho.cols());
  CHECK(((tlm.psi_rho - adjoint.psi_rho).array() / size.array()).abs().maxCoeff() < 1e-10);
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double h = 1e-4 * std::max(1e-2, std::abs(rho(k)));
    const auto psi_at = [&](double step) {
      VectorXd shifted = rho;
      shifted(k) += step;
      const Mechanism there(scene, shifted);
      RunOptions frozen;
      frozen.frozen = &tlm.steps;
      return simulate(there, scene.simulation, costs_of(there), {}, frozen).psi;
    };
    // Central differences of steps h and h/2, extrapolated.
    const VectorXd d1 = (psi_at(h) - psi_at(-h)) / (2 * h), d2 = (psi_at(h / 2) - psi_at(-h / 2)) / h;
    const VectorXd d = d2 + (d2 - d1) / 3;
    for (Eigen::Index o = 0; o < d.size(); ++o) CHECK(std::abs(d(o) - tlm.psi_rho(o, k)) < 1e-7 * size(o, 0));
  }
}

TEST_CASE("planar and spatial models are solved alike", "[driven]") {
  Scene scene = slider_crank();
  const Mechanism m(scene, nominal(scene));
  const SimulationResult planar = simulate_adjoint(m, scene.simulation, costs_of(m));
  scene.simulation.model = ModelChoice::spatial;
  const SimulationResult spatial = simulate_adjoint(m, scene.simulation, costs_of(m));
  REQUIRE(planar.ok());
  REQUIRE(spatial.ok());
  CHECK((planar.psi - spatial.psi).cwiseAbs().maxCoeff() < 1e-11);
  CHECK((planar.psi_rho - spatial.psi_rho).cwiseAbs().maxCoeff() < 1e-9 * planar.psi_rho.cwiseAbs().maxCoeff());
}

// The rod lies in the plane z = h, so that psi = int z x dt of its end has d psi/dh = psi/h.
TEST_CASE("solved in a plane: a parameter that moves a body out of it", "[driven]") {
  Scene scene = slider_crank();
  add_parameters(scene, {{"h", 0.3}});
  scene.joints[1].point1 = vec("r", "0", "h");
  scene.joints[2].point1 = vec("l", "0", "-h");
  scene.sensors.push_back(point_sensor("z", "position", "rod", vec("l", "0", "0"), "z"));
  const VectorXd rho = nominal(scene);
  const Mechanism m(scene, rho);
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<SensorProduct>(m, m.sensor("z"), m.sensor("x"));
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, costs);
  INFO(tlm.message << adjoint.message);
  REQUIRE(tlm.ok());
  REQUIRE(adjoint.ok());
  REQUIRE(tlm.statistics.solved);
  const Eigen::Index h = rho.size() - 1;
  CHECK(tlm.psi_rho(0, h) == Approx(tlm.psi(0) / rho(h)).epsilon(1e-12));
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-10 * tlm.psi_rho.cwiseAbs().maxCoeff());
}

TEST_CASE("observers of solved runs see states, tangents and rates", "[driven]") {
  const Scene scene = slider_crank();
  const VectorXd rho = nominal(scene);
  const Mechanism m(scene, rho);
  TangentSampling sampling;
  sampling.times = {0, 0.31, 0.31, 1.9, 2};
  std::vector<double> x, x_r, v, a;
  sampling.observe = [&](std::size_t, const StatePoint& at, const MatrixXd& y_rho) {
    x.push_back(at.y(14)), x_r.push_back(y_rho(14, 0));
    v.push_back((*at.ydot)(14)), a.push_back((*at.ydot)(21 + 14));
  };
  REQUIRE(simulate_tlm(m, scene.simulation, {}, sampling).ok());
  REQUIRE(x.size() == sampling.times.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double t = sampling.times[i], h = 1e-5;
    VectorXd up = rho, down = rho;
    up(0) += h, down(0) -= h;
    CHECK(x[i] == Approx(slider_x(rho, t)).epsilon(1e-12));
    CHECK(x_r[i] == Approx((slider_x(up, t) - slider_x(down, t)) / (2 * h)).epsilon(1e-8));
    CHECK(v[i] == Approx((slider_x(rho, t + h) - slider_x(rho, t - h)) / (2 * h)).margin(1e-7));
    CHECK(a[i] ==
          Approx((slider_x(rho, t + 1e-4) - 2 * slider_x(rho, t) + slider_x(rho, t - 1e-4)) / 1e-8).margin(1e-4));
  }
}

TEST_CASE("runs that no drive determines, or that settings integrate, are not solved", "[driven]") {
  Scene scene = slider_crank();
  scene.simulation.end_time = 0.1;
  const auto solved = [](const Scene& s) { return simulate(Mechanism(s, nominal(s)), s.simulation).statistics.solved; };
  CHECK(solved(scene));
  Scene other = scene;
  other.simulation.integrator.step = 0.01;
  CHECK_FALSE(solved(other));
  other = scene;
  other.simulation.formulation = FormulationSettings::penalty();
  CHECK_FALSE(solved(other));
  other = scene;
  other.simulation.integrator.type = "cvodes_adams";
  CHECK_FALSE(solved(other));
  other = scene;
  other.bodies.push_back(plain_body("free", 1, {1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, vec("3", "0", "0")));
  CHECK_FALSE(solved(other));
  other.simulation.solve = Solve::kinematics;
  CHECK_THROWS_WITH(solved(other), Catch::Contains("the drives leave 6 degrees of freedom"));
  other = scene;
  other.simulation.solve = Solve::kinematics;
  other.simulation.integrator.step = 0.01;
  CHECK_THROWS_WITH(solved(other), Catch::Contains("simulation.integrator.step"));
}

TEST_CASE("a dead point that the drive cannot pass ends a solved run in words", "[driven]") {
  Scene scene = slider_crank();
  scene.drives.clear();
  Drive push;
  push.name = "motor", push.type = "displacement", push.joint = "guide", push.law = f("0.8 + 0.1*t");
  scene.drives.push_back(push);
  scene.bodies[0].orientation = AxisAngleField{vec("0", "0", "1"), f("1")};
  const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  CHECK_FALSE(run.ok());
  CHECK(run.last_good_time == Approx(1).epsilon(0.01));  // the bars are in line, x = r + l
  CHECK_THAT(run.message, Catch::Contains("cannot be continued beyond"));
}

TEST_CASE("a running cost with a kink is integrated to the tolerance", "[driven]") {
  struct Kink final : RunningCost {
    double g(double t, VecIn, VecIn) const override { return std::abs(t - 0.7123); }
    void add_g_y(double, VecIn, VecIn, double, VecOut) const override {}
    void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
  };
  const Scene scene = slider_crank();
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = point_cost(std::make_shared<Kink>(), m);
  const SimulationResult run = simulate(m, scene.simulation, costs);
  REQUIRE(run.ok());
  CHECK(run.psi(0) == Approx((0.7123 * 0.7123 + 1.2877 * 1.2877) / 2).epsilon(1e-10));
  CHECK(run.statistics.rejected > 0);
}
