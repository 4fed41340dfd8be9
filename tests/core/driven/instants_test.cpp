// Solved runs see what happens between their nodes: peaks at any instant, fast steps of drives, bumps of forces.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

const double kRootPi = std::sqrt(std::numbers::pi);

// A ram of mass m along x, driven.
Scene ram(const std::string& law) {
  Scene s;
  add_parameters(s, {{"m", 2.0}, {"w", 0.02}, {"at", 0.313}, {"F", 50.0}});
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("ram", 2, {1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.bodies.back().mass = f("m");
  Joint guide;
  guide.name = "guide", guide.type = "translational", guide.body2 = "ram";
  guide.axis1 = vec("1", "0", "0"), guide.axis2 = vec("1", "0", "0");
  s.joints.push_back(guide);
  Drive push;
  push.name = "push", push.type = "displacement", push.joint = "guide", push.law = f(law);
  s.drives.push_back(push);
  s.sensors.push_back(point_sensor("x", "position", "ram", vec("0", "0", "0"), "x"));
  s.sensors.push_back(point_sensor("v", "velocity", "ram", vec("0", "0", "0"), "x"));
  Sensor force;
  force.name = "force", force.quantity = "drive_force", force.drive = "push";
  s.sensors.push_back(force);
  IntegratorSettings& integrator = s.simulation.integrator;
  integrator.type = "dopri853", integrator.rtol = 1e-8, integrator.atol = 1e-10;
  return s;
}

struct Peak final : RunningCost {
  double at, width;
  Peak(double t, double s) : at(t), width(s) {}
  double g(double t, VecIn y, VecIn) const override { return 1e-3 * y(0) + std::exp(-std::pow((t - at) / width, 2)); }
  void add_g_y(double, VecIn, VecIn, double scale, VecOut out) const override { out(0) += 1e-3 * scale; }
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
};

std::vector<Cost> work_of(const Mechanism& m) {
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<SensorProduct>(m, m.sensor("force"), m.sensor("v"));
  return costs;
}

}  // namespace

TEST_CASE("a solved run integrates a peak at any instant", "[driven]") {
  Scene scene = ram("0.1*t");
  const double end = 3, width = 0.008;  // a 400th of the run
  scene.simulation.end_time = end;
  const Mechanism m(scene, nominal(scene));
  for (double at = 0.1; at < end - 0.1; at += 0.0371) {
    std::vector<Cost> costs(1);
    costs[0].running = point_cost(std::make_shared<Peak>(at, width), m);
    const SimulationResult run = simulate(m, scene.simulation, costs);
    REQUIRE(run.ok());
    INFO(at);
    CHECK(run.psi(0) == Approx(width * kRootPi + 1e-4 * end * end / 2).epsilon(1e-7));
  }
}

TEST_CASE("a solved run looks at its costs at least each max_step", "[driven]") {
  Scene scene = ram("0.1*t");
  scene.simulation.end_time = 3;
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = point_cost(std::make_shared<Peak>(1.23457, 3e-4), m);
  scene.simulation.integrator.max_step = 1e-3;
  const SimulationResult run = simulate(m, scene.simulation, costs);
  REQUIRE(run.ok());
  CHECK(run.psi(0) == Approx(3e-4 * kRootPi + 1e-4 * 4.5).epsilon(1e-7));
}

// The kinetic energy of the ram before and after the step is m v^2/2, so that the work is 0, and that of v^2 is known:
// x = 0.1 tanh((t - t0)/s), v^2 dt = 0.01/s 4/3.
TEST_CASE("a solved run resolves a drive that steps within a ten-thousandth of the run", "[driven]") {
  Scene scene = ram("0.1*tanh((t - 0.71234)/0.0002)");
  scene.simulation.end_time = 2;
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<SensorProduct>(m, m.sensor("v"), m.sensor("v"));
  const SimulationResult run = simulate(m, scene.simulation, costs);
  REQUIRE(run.ok());
  CHECK(run.psi(0) == Approx(0.01 / 0.0002 * 4 / 3).epsilon(1e-7));
}

// A half sine of 1 ms among samples 0.1 ms apart, as the integrand and as a force on the ram, whose speed is constant.
TEST_CASE("a solved run sees each pulse of a record", "[driven]") {
  Scene scene = ram("0.4*t");
  std::vector<double> t, y;
  double sum = 0;
  for (int i = 0; i <= 20000; ++i) {
    t.push_back(i * 1e-4),
        y.push_back(i > 12340 && i < 12350 ? 300 * std::sin(std::numbers::pi * (i - 12340) / 10) : 0);
    sum += y.back() * 1e-4;
  }
  const Interpolation how = GENERATE(Interpolation::linear, Interpolation::spline);
  Signal record;
  record.name = "blow", record.interpolation = how, record.curve = std::make_shared<const Curve>(how, t, y);
  scene.signals.push_back(record);
  PointForce blow;
  blow.body = "ram", blow.components = {f("-blow"), f("0"), f("0")};
  scene.forces.push_back({"blow", blow});
  scene.simulation.end_time = 2;
  const Mechanism m(scene, nominal(scene));
  const SimulationResult run = simulate(m, scene.simulation, work_of(m));
  REQUIRE(run.ok());
  CHECK(run.psi(0) == Approx(0.4 * sum).epsilon(1e-6));
}

// The force -F exp(-((x - at)/w)^2) on the ram depends on its place. The drive does the work F w sqrt(pi) against it.
TEST_CASE("solved: a narrow bump of a force over a path, and its gradients by all methods", "[driven]") {
  Scene scene = ram("t + 0.05*sin(2*t)");
  PointForce bump;
  bump.body = "ram", bump.components = {f("-F*exp(-((x - at)/w)^2)"), f("0"), f("0")};
  scene.forces.push_back({"bump", bump});
  scene.simulation.end_time = 2;
  scene.simulation.model = GENERATE(ModelChoice::automatic, ModelChoice::spatial);
  const VectorXd rho = nominal(scene);
  const auto work = [&](const VectorXd& at) {
    const Mechanism m(scene, at);
    return simulate(m, scene.simulation, work_of(m)).psi(0);
  };
  const Mechanism m(scene, rho);
  const SimulationResult tlm = simulate_tlm(m, scene.simulation, work_of(m));
  const SimulationResult adjoint = simulate_adjoint(m, scene.simulation, work_of(m));
  REQUIRE(tlm.ok());
  REQUIRE(adjoint.ok());
  const auto kinetic = [&](double v) { return rho(0) / 2 * v * v; };
  const double exact = 50 * 0.02 * kRootPi + kinetic(1 + 0.1 * std::cos(4)) - kinetic(1.1);
  CHECK(tlm.psi(0) == Approx(exact).epsilon(1e-7));
  CHECK(tlm.psi(0) == adjoint.psi(0));
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-9 * tlm.psi_rho.cwiseAbs().maxCoeff());
  // Runs with panels of their own: the value is smooth in the parameters.
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    VectorXd up = rho, down = rho;
    const double h = 1e-3 * rho(k);
    up(k) += h, down(k) -= h;
    CHECK((work(up) - work(down)) / (2 * h) == Approx(tlm.psi_rho(0, k)).epsilon(1e-5).margin(1e-5));
  }
}
