// Runs across kinks and jumps against closed forms, and their gradients.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/event/switches.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct SensorCost final : PointCost {
  const Mechanism mechanism;
  int sensor;
  SensorCost(const Mechanism& m, const std::string& name) : mechanism(m), sensor(m.sensor(name)) {}
  double value(const StatePoint& at) const override { return mechanism.sensor_value(sensor, at); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    return mechanism.add_sensor_gradient(sensor, at, scale, y_bar, rho_bar);
  }
};

Sensor quantity(const std::string& name, const std::string& what, const std::string& component) {
  Sensor s;
  s.name = name, s.quantity = what, s.body = "block", s.component = component;
  return s;
}

// A block of 1 kg on a rail at x = 0 that moves at `vi`, with a force along the rail.
Scene block(const std::vector<std::pair<std::string, double>>& parameters, const std::string& force) {
  Scene s;
  add_parameters(s, parameters);
  s.gravity = {0.0, 0.0, 0.0};
  Body b;
  b.name = "block", b.mass = 1.0, b.inertia = {0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(b);
  Joint rail;
  rail.name = "rail", rail.type = "translational", rail.body2 = "block";
  rail.axis1 = rail.axis2 = vec("1", "0", "0");
  s.joints.push_back(rail);
  s.sensors = {quantity("x", "position", "x"), quantity("v", "velocity", "x")};
  PointForce load;
  load.body = "block", load.components = {f(force), f("0"), f("0")};
  s.forces.push_back({"push", load});
  s.conditions = {value_of("x", "0"), rate_of("x", "vi")};
  s.simulation.integrator.rtol = 1e-11, s.simulation.integrator.atol = 1e-13;
  return s;
}

std::vector<Cost> costs_of(const Mechanism& mechanism) {
  std::vector<Cost> costs(2);
  costs[0].terminal = std::make_shared<SensorCost>(mechanism, "x");
  costs[1].terminal = std::make_shared<SensorCost>(mechanism, "v");
  return costs;
}

// (x, v) at the end as a function of the parameters.
using ClosedForm = VectorXd (*)(const VectorXd& rho);

MatrixXd slopes(ClosedForm f, const VectorXd& rho) {
  MatrixXd J(2, rho.size());
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double h = 1e-3 * std::abs(rho(k));
    const auto at = [&](double steps) {
      VectorXd there = rho;
      there(k) += steps * h;
      return f(there);
    };
    J.col(k) = (45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + at(3) - at(-3)) / (60 * h);
  }
  return J;
}

void check_closed_form(Scene scene, ClosedForm exact) {
  const auto [type, model] =
      GENERATE(std::pair("dopri5", ModelChoice::planar), std::pair("dopri5", ModelChoice::spatial),
               std::pair("dopri853", ModelChoice::planar), std::pair("dopri853", ModelChoice::spatial),
               std::pair("radau5", ModelChoice::spatial), std::pair("sdirk4", ModelChoice::spatial),
               std::pair("rodas4", ModelChoice::spatial));
  scene.simulation.integrator.type = type;
  scene.simulation.model = model;
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const std::vector<Cost> costs = costs_of(mechanism);
  const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs);
  INFO(type << (model == ModelChoice::planar ? ", planar: " : ", spatial: ") << tlm.message << adjoint.message);
  REQUIRE((tlm.ok() && adjoint.ok()));
  CHECK((tlm.psi - exact(rho)).cwiseAbs().maxCoeff() < 1e-8);
  CHECK(tlm.psi == adjoint.psi);
  const MatrixXd J = slopes(exact, rho);
  INFO("exact\n" << J << "\nby tlm\n" << tlm.psi_rho);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double size = J.row(i).cwiseAbs().maxCoeff();
    CHECK((tlm.psi_rho - J).row(i).cwiseAbs().maxCoeff() < 1e-7 * size);
    CHECK((tlm.psi_rho - adjoint.psi_rho).row(i).cwiseAbs().maxCoeff() < 1e-11 * size);
  }
  CHECK(tlm.statistics.jumps.empty());
}

// rho = (c, vi, K, gap); the run ends at 0.07 s, in contact.
VectorXd inside_kelvin_voigt(const VectorXd& rho) {
  const double c = rho(0), vi = rho(1), K = rho(2), gap = rho(3), s = 0.07 - gap / vi, w = std::sqrt(K - c * c / 4);
  const double e = std::exp(-c * s / 2), d = vi * e * std::sin(w * s) / w;
  return Eigen::Vector2d(gap + d, vi * e * std::cos(w * s) - c / 2 * d);
}

// rho = (f, vi, ts): a force f from ts on, until 0.5 s.
VectorXd switched_on(const VectorXd& rho) {
  const double s = 0.5 - rho(2);
  return Eigen::Vector2d(0.5 * rho(1) + 0.5 * rho(0) * s * s, rho(1) + rho(0) * s);
}

// rho = (f, vi, place): a force -f beyond a place.
VectorXd slowed_down(const VectorXd& rho) {
  const double s = 0.5 - rho(2) / rho(1);
  return Eigen::Vector2d(0.5 * rho(1) - 0.5 * rho(0) * s * s, rho(1) - rho(0) * s);
}

}  // namespace

TEST_CASE("a stop whose damper begins with a jump has exact gradients within the contact", "[events]") {
  Scene s = block({{"c", 15}, {"vi", 1.7}, {"K", 9000}, {"gap", 0.08}},
                  "-(abs(x - gap)/(x - gap) + 1)/2*(K*(x - gap) + c*v)");
  s.simulation.end_time = 0.07;
  check_closed_form(s, inside_kelvin_voigt);
}

TEST_CASE("a force that begins at a time has exact gradients in this time", "[events]") {
  const std::string law =
      GENERATE(as<std::string>{}, "f*(1 + abs(t - ts)/(t - ts))/2", "f*(1 + (t - ts)/abs(t - ts))/2",
               "f*max(0, t - ts)/(t - ts)", "f*(1 + (t - ts)/sqrt((t - ts)^2))/2");
  INFO(law);
  Scene s = block({{"f", 3}, {"vi", 0.4}, {"ts", 0.2}}, law);
  s.simulation.end_time = 0.5;
  check_closed_form(s, switched_on);
}

TEST_CASE("a force that begins at a place has exact gradients in this place", "[events]") {
  const std::string law =
      GENERATE(as<std::string>{}, "-f*(1 + abs(x - place)/(x - place))/2", "-f*max(0, x - place)/(x - place)");
  INFO(law);
  Scene s = block({{"f", 1.1}, {"vi", 0.9}, {"place", 0.15}}, law);
  s.simulation.end_time = 0.5;
  check_closed_form(s, slowed_down);
}

namespace {

// rho = (F, vi, ts): x'' = F (x + 1) from ts on, until 0.5 s.
VectorXd let_go(const VectorXd& rho) {
  const double w = std::sqrt(rho(0)), s = 0.5 - rho(2), C = std::cosh(w * s), S = std::sinh(w * s);
  const double z = rho(1) * rho(2) + 1;
  return Eigen::Vector2d(z * C + rho(1) / w * S - 1, z * w * S + rho(1) * C);
}

}  // namespace

TEST_CASE("a decision that jumps with another one follows the instant of that", "[events]") {
  Scene s = block({{"F", 2}, {"vi", 0.3}, {"ts", 0.2}}, "F*max(0, x + abs(t - ts)/(t - ts))");
  s.simulation.end_time = 0.5;
  check_closed_form(s, let_go);
}

TEST_CASE("a running cost of an acceleration that jumps has exact gradients", "[events]") {
  Scene s = block({{"F", 3}, {"vi", 0.4}, {"ts", 0.2}}, "F*(1 + abs(t - ts)/(t - ts))/2");
  s.sensors.push_back(quantity("a", "acceleration", "x"));
  s.simulation.end_time = 0.5;
  const Mechanism mechanism(s, nominal(s));
  struct AccelerationTimesTime final : PointCost {
    const Mechanism mechanism;
    explicit AccelerationTimesTime(const Mechanism& m) : mechanism(m) {}
    double value(const StatePoint& at) const override { return at.t * mechanism.sensor_value(2, at); }
    double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
      return at.t * mechanism.add_sensor_gradient(2, at, at.t * scale, y_bar, rho_bar);
    }
    std::shared_ptr<const PointCost> bound_to(const Mechanism& m, const Program*) const override {
      return std::make_shared<AccelerationTimesTime>(m);
    }
  };
  Cost cost;
  cost.running = std::make_shared<AccelerationTimesTime>(mechanism);
  const std::vector<Cost> costs{cost};
  for (const SimulationResult& run :
       {simulate_tlm(mechanism, s.simulation, costs), simulate_adjoint(mechanism, s.simulation, costs)}) {
    REQUIRE(run.ok());
    CHECK(run.psi(0) == Approx(3 * (0.25 - 0.04) / 2).epsilon(1e-9));
    CHECK(run.psi_rho(0, 0) == Approx((0.25 - 0.04) / 2).epsilon(1e-9));
    CHECK(run.psi_rho(0, 2) == Approx(-3 * 0.2).epsilon(1e-9));
  }
}

TEST_CASE("an event on the grid of fixed steps is one event", "[events]") {
  Scene s = block({{"F", 5}, {"vi", -3}}, "F");
  s.simulation.end_time = 0.9;
  s.simulation.integrator.type = "rk4", s.simulation.integrator.step = 1e-3;
  std::get<PointForce>(s.forces[0].kind).components[0] = f("F - 5*max(v, 0)");
  const Mechanism braked(s, nominal(s));
  const SimulationResult run = simulate_tlm(braked, s.simulation, costs_of(braked));
  REQUIRE(run.ok());
  CHECK(run.steps.events.size() == 1);
  CHECK(run.steps.events[0].after != 0);
  CHECK(run.steps.sizes.size() <= 901);
}

TEST_CASE("the sides, the events and the grid of fixed steps", "[events]") {
  Scene s = block({{"vi", 0.9}}, "-2000*max(0, x - 0.151)");
  s.simulation.end_time = 0.5;
  s.simulation.integrator.type = "rk4", s.simulation.integrator.step = 1e-2;
  const Mechanism mechanism(s, nominal(s));
  const SimulationResult run = simulate(mechanism, s.simulation);
  REQUIRE(run.ok());
  REQUIRE(run.steps.sides.size() == 1);
  const int before = run.steps.sides[0];
  REQUIRE(run.steps.events.size() == 2);
  CHECK(run.steps.events[0].after == -before);
  CHECK(run.steps.events[1].after == before);
  const auto end_of = [&](std::size_t i) { return run.steps.times[i] + run.steps.sizes[i]; };
  CHECK(end_of(run.steps.events[0].step) == Approx(0.151 / 0.9).epsilon(1e-12));
  CHECK(run.steps.sizes.size() == 52);  // two more than 50
  for (int k = 1; k <= 50; ++k) {
    INFO(k);
    bool found = false;
    for (std::size_t i = 0; i < run.steps.sizes.size(); ++i) found = found || std::abs(end_of(i) - 0.01 * k) < 1e-12;
    CHECK(found);
  }
  RunOptions frozen;
  frozen.frozen = &run.steps;
  const SimulationResult again = simulate(mechanism, s.simulation, {}, {}, frozen);
  CHECK(again.y_end == run.y_end);
}

TEST_CASE("two contacts within one step are found", "[events]") {
  Scene s = block({{"vi", 0.9}}, "-4 - 50000*max(0, x - 0.101248)");
  s.simulation.end_time = 0.4;
  s.simulation.integrator.type = "rk4", s.simulation.integrator.step = 0.4;
  const SimulationResult run = simulate(Mechanism(s, nominal(s)), s.simulation);
  REQUIRE(run.ok());
  CHECK(run.steps.events.size() == 2);  // x = 0.9 t - 2 t^2 comes to 0.10125
}

TEST_CASE("without a side that leads away from it, a switch is held no more", "[events]") {
  Scene s = block({{"vi", 0.3}}, "-2*abs(v)/v");  // Coulomb's friction, at rest from 0.15 s on
  s.simulation.end_time = 0.2;
  s.simulation.integrator.rtol = 1e-6, s.simulation.integrator.atol = 1e-6;
  const Mechanism mechanism(s, nominal(s));
  const SimulationResult run = simulate_tlm(mechanism, s.simulation, costs_of(mechanism));
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK(run.psi(0) == Approx(0.0225).epsilon(1e-5));
  CHECK(run.steps.events.back().after == 0);
  CHECK(!run.statistics.jumps.empty());
}

namespace {

// The gradients of both sweeps, also with little memory, against differences of free runs with steps of `part` of each
// parameter.
void check_free_runs(Scene s, const Cost& cost, double part, double allowed) {
  const auto [type, model] =
      GENERATE(std::pair("dopri853", ModelChoice::planar), std::pair("dopri853", ModelChoice::spatial),
               std::pair("radau5", ModelChoice::spatial));
  s.simulation.integrator.type = type, s.simulation.model = model;
  s.simulation.integrator.rtol = s.simulation.integrator.type == "radau5" ? 1e-9 : 1e-11;
  s.simulation.integrator.atol = 1e-12;
  const VectorXd rho = nominal(s);
  const Mechanism mechanism(s, rho);
  const std::vector<Cost> costs{cost};
  const SimulationResult tlm = simulate_tlm(mechanism, s.simulation, costs);
  INFO(tlm.message);
  REQUIRE(tlm.ok());
  CHECK(tlm.steps.events.size() >= 3);
  CHECK(tlm.statistics.impacts.empty() == s.limits.empty());
  SimulationSettings small = s.simulation;
  small.adjoint_memory_mib = 1e-3;
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  for (const SimulationSettings& settings : {s.simulation, small}) {
    const SimulationResult adjoint = simulate_adjoint(mechanism, settings, costs);
    REQUIRE(adjoint.ok());
    CHECK((adjoint.psi_rho - tlm.psi_rho).cwiseAbs().maxCoeff() < 1e-10 * size);
    if (settings.adjoint_memory_mib < 1) CHECK(adjoint.statistics.recomputed_steps > 0);
  }
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const double h = part * std::max(std::abs(rho(k)), 0.1);
    const auto psi = [&](double steps) {
      VectorXd there = rho;
      there(k) += steps * h;
      const SimulationResult run = simulate(Mechanism(s, there), s.simulation, costs);
      INFO(run.message);
      REQUIRE(run.ok());
      return run.psi(0);
    };
    const double difference = (8 * (psi(1) - psi(-1)) - (psi(2) - psi(-2))) / (12 * h);
    INFO(s.parameters[static_cast<std::size_t>(k)].name);
    CHECK(tlm.psi_rho(0, k) == Approx(difference).epsilon(allowed).margin(allowed * size));
  }
}

// Two bars on hinges that swing between stops, with a torque that begins at a time and one that changes at an angle.
Scene swinging_bars() {
  Scene s = double_pendulum();
  add_parameters(s, {{"k", 900}, {"stop", 0.35}, {"ts", 0.31}, {"push", 1.5}, {"turn", -0.2}, {"l", 0.4}});
  s.gravity = {0.0, -9.81, 0.0};
  for (const char* joint : {"A", "B"}) {
    Rsda stop;
    stop.joint = joint, stop.law = f("k*max(0, angle - stop) - k*max(0, -stop - angle) + 0.1*rate");
    s.forces.push_back({std::string("stop ") + joint, stop});
  }
  s.sensors.push_back(angle_sensor("a", s.joints[0].name));
  Torque motor;
  motor.body = s.bodies[0].name;
  motor.components = {f("0"), f("0"), f("push*(1 + abs(t - ts)/(t - ts))/2 + l*abs(a - turn)/(a - turn)")};
  s.forces.push_back({"motor", motor});
  s.simulation.end_time = 1.2;
  return s;
}

}  // namespace

TEST_CASE("gradients through many events are those of free runs, by both sweeps and with little memory", "[events]") {
  Cost cost;
  cost.terminal = std::make_shared<StateNorm>();
  cost.samples = {{0.7, std::make_shared<StateNorm>()}};
  check_free_runs(swinging_bars(), cost, 1e-4, 2e-6);
}

namespace {

// A ball of 1 kg above a floor at 0.
Scene ball_above_floor() {
  Scene s = block({{"h", 1}, {"e", 0.8}, {"g", 9.81}, {"vi", 0}}, "-g");
  s.conditions = {value_of("x", "h"), rate_of("x", "vi")};
  Limit floor;
  floor.name = "floor", floor.sensor = "x", floor.lower = f("0"), floor.restitution = f("e");
  s.limits = {floor};
  return s;
}

// rho = (h, e, g, vi), with vi = 0 in the values; (height, speed) after two impacts at 1.7 s.
VectorXd bounced_twice(const VectorXd& rho) {
  const double h = rho(0), e = rho(1), g = rho(2), vi = rho(3);
  double v = std::sqrt(vi * vi + 2 * g * h), t = (vi + v) / g;
  for (int i = 0; i < 1; ++i) t += 2 * e * v / g, v *= e;
  const double tau = 1.7 - t;
  return Eigen::Vector2d(e * v * tau - g * tau * tau / 2, e * v - g * tau);
}

}  // namespace

TEST_CASE("a ball that bounces has exact gradients in height, restitution and gravity", "[events]") {
  Scene s = ball_above_floor();
  s.simulation.end_time = 1.7;
  s.parameters[3].value = 0.1;  // so that its steps of differences are not 0
  check_closed_form(s, bounced_twice);
}

TEST_CASE("impacts lose the energy of their restitution, and a ball at rest ends the run in words", "[events]") {
  Scene s = ball_above_floor();
  s.simulation.end_time = 4;
  const Mechanism mechanism(s, nominal(s));
  const SimulationResult run = simulate(mechanism, s.simulation);
  REQUIRE(run.ok());
  REQUIRE(run.statistics.impacts.size() > 10);
  double v = std::sqrt(2 * 9.81), t = v / 9.81;
  for (std::size_t i = 0; i < 10; ++i) {
    CHECK(run.statistics.impacts[i].time == Approx(t).epsilon(1e-10));
    CHECK(run.statistics.impacts[i].impulse == Approx(1.8 * v).epsilon(1e-9));
    t += 2 * 0.8 * v / 9.81, v *= 0.8;
  }
  s.simulation.end_time = 5;
  const SimulationResult rests = simulate(Mechanism(s, nominal(s)), s.simulation);
  CHECK_FALSE(rests.ok());
  CHECK(rests.message.find("limit 'floor' comes to rest at t = 4.06") != std::string::npos);
  s.conditions = {value_of("x", "-0.1"), rate_of("x", "1")};
  CHECK(simulate(Mechanism(s, nominal(s)), s.simulation).message.find("passed at the start") != std::string::npos);
}

// The gap is that of a point whose place, and so the impulse, depends on parameters and the motion of two bodies.
TEST_CASE("impacts of a chain have the gradients of free runs", "[events]") {
  Scene s = double_pendulum();
  add_parameters(s, {{"e", 0.7}, {"floor", -1.3}, {"tip", 0.7}, {"wall", -0.9}});
  s.gravity = {0.0, -9.81, 0.0};
  s.sensors.push_back(point_sensor("height", "position", "lower", vec("tip", "0", "0"), "y"));
  Limit floor, wall;
  floor.name = "floor", floor.sensor = "height", floor.lower = f("floor"), floor.restitution = f("e");
  wall.name = "wall", wall.sensor = "theta2", wall.lower = f("wall"), wall.upper = f("0.6"),
  wall.restitution = f("0.5");
  s.limits = {floor, wall};
  s.simulation.end_time = 1.1;
  Cost cost;
  cost.terminal = cost.running = std::make_shared<StateNorm>();
  check_free_runs(s, cost, 1e-5, 5e-6);
}
