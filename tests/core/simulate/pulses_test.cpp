// Pulses of laws and signals that are shorter than the steps of the motion around them.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/simulate/simulation.hpp"
#include "core/simulate/simulation_warnings.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

struct Speed final : PointCost {  // of the only body along x
  double value(const StatePoint& at) const override { return at.y(7); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut) const override {
    y_bar(7) += scale;
    return at.y(7);
  }
};

// Samples every dt up to `end`: a half sine of height 1 over n intervals from each of the samples `first`.
Signal blows(Interpolation how, double dt, double end, int n, const std::vector<int>& first) {
  Signal s;
  s.name = "u", s.interpolation = how;
  std::vector<double> t, y;
  for (int i = 0; i * dt < end + 0.5 * dt; ++i) {
    t.push_back(i * dt), y.push_back(0);
    for (const int k : first)
      if (i > k && i < k + n) y.back() = std::sin(std::numbers::pi * (i - k) / n);
  }
  s.curve = std::make_shared<const Curve>(how, std::move(t), std::move(y));
  return s;
}

struct Place final : PointCost {  // of the last body along x
  double value(const StatePoint& at) const override { return at.y(at.y.size() / 2 - 7); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut) const override {
    y_bar(at.y.size() / 2 - 7) += scale;
    return value(at);
  }
};

struct Run {
  double v, v_tlm, v_adjoint;  // at the end, and its derivatives in P
};
Run run_of(const Scene& scene, std::shared_ptr<const PointCost> at_end = std::make_shared<Speed>()) {
  const Mechanism mechanism(scene, nominal(scene));
  const std::vector<Cost> costs{{nullptr, std::move(at_end), {}, "v"}};
  const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs, {}, {});
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs, {});
  INFO(tlm.message << adjoint.message);
  REQUIRE((tlm.ok() && adjoint.ok()));
  for (const std::string& warning : simulation_warnings(scene, scene.simulation, tlm.statistics, true)) {
    INFO(warning);
    CHECK(false);
  }
  CHECK(simulate(mechanism, scene.simulation, costs, {}, {}).psi(0) == Approx(tlm.psi(0)).epsilon(1e-9));
  return {tlm.psi(0), tlm.psi_rho(0, 0), adjoint.psi_rho(0, 0)};
}

Scene cart(const std::string& force, double end, const std::string& method) {
  Scene scene = pushed_cart(force, end, 1e-8);
  add_parameters(scene, {{"P", 1.7}});
  scene.simulation.integrator.type = method;
  return scene;
}

}  // namespace

TEST_CASE("pulses of laws are resolved wherever they lie", "[pulses]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri853", "dopri5", "radau5", "rodas4");
  struct Case {
    const char* force;
    double end, impulse_per_P;
  };
  const auto [force, end, impulse] = GENERATE(values<Case>({
      {"P*max(0, 1 - abs(t - 3.1373)/0.0002)/0.0002", 10, 1},
      {"P*(exp(-((t - 7.77)/2e-4)^2) + exp(-((t - 0.4321)/1e-4)^2))/sqrt(pi)", 8, 3e-4},
      {"P*(tanh((t - 2.2222)/1e-4) - tanh((t - 2.2242)/1e-4))", 20, 4e-3},
      {"0.1*t + 50*P*max(0, 1 - abs(t - 1.9999)/1e-4)", 2, 5e-3},
      {"P*max(0, 1 - t/1e-3)", 5, 5e-4},
  }));
  CAPTURE(method, force);
  const Scene scene = cart(force, end, method);
  const Run r = run_of(scene);
  const double ramp = std::string(force).starts_with("0.1") ? 0.05 * end * end : 0;
  CHECK(r.v - ramp == Approx(1.7 * impulse).epsilon(1e-4));
  CHECK(r.v_tlm == Approx(impulse).epsilon(1e-4));
  CHECK(r.v_adjoint == Approx(impulse).epsilon(1e-4));
}

// A blow on the point of a ball joint moves nothing, but the joint bears it.
TEST_CASE("a blow that only a reaction shows is seen where a cost reads that", "[pulses]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri853", "dopri5", "radau5", "cvodes_bdf");
  CAPTURE(method);
  Scene scene = cart("30*max(0, 1 - abs(t - 3.1373)/2e-4)/2e-4", 10, method);
  scene.joints[0].type = "spherical";
  scene.bodies[0].angular_velocity = {0.3, 0.0, 0.0};
  Sensor reaction;
  reaction.name = "R", reaction.quantity = "reaction", reaction.joint = "slide", reaction.kind = "force";
  reaction.component = "x";
  scene.sensors.push_back(reaction);
  const Mechanism mechanism(scene, nominal(scene));
  struct Borne final : PointCost {
    explicit Borne(const Mechanism& m) : mechanism(m) {}
    double value(const StatePoint& at) const override { return mechanism.sensor_value(0, at); }
    double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
      return mechanism.add_sensor_gradient(0, at, scale, y_bar, rho_bar);
    }
    Mechanism mechanism;
  };
  const std::vector<Cost> costs{{std::make_shared<Borne>(mechanism), nullptr, {}, "borne"}};
  const SimulationResult result = simulate(mechanism, scene.simulation, costs, {}, {});
  REQUIRE(result.ok());
  CHECK(std::abs(std::abs(result.psi(0)) - 30) < 30 * 1e-4);
  CHECK(simulation_warnings(scene, scene.simulation, result.statistics, true).empty());
}

// A blow back at once after a blow leaves no speed, but a way.
TEST_CASE("double pulses that cancel in the speed are resolved", "[pulses]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri853", "dopri5", "radau5", "rodas4");
  CAPTURE(method);
  Scene scene = cart("1e12*P*(4.321 - t)*exp(-((t - 4.321)/1e-4)^2)", 9, method);
  const double way = 0.5 * std::sqrt(std::numbers::pi);
  const Run r = run_of(scene, std::make_shared<Place>());
  CHECK(r.v == Approx(1.7 * way).epsilon(1e-4));
  CHECK(r.v_tlm == Approx(way).epsilon(1e-4));
  CHECK(r.v_adjoint == Approx(way).epsilon(1e-4));
}

TEST_CASE("CVODES sees a double pulse to its tolerance of the speed within it", "[pulses]") {
  Scene scene = cart("1e12*P*(4.321 - t)*exp(-((t - 4.321)/1e-4)^2)", 9, "cvodes_bdf");
  const std::vector<Cost> costs{{nullptr, std::make_shared<Place>(), {}, "x"}};
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation, costs, {}, {});
  REQUIRE(result.ok());
  const double speed = 1.7 * 0.5 * 1e4;
  CHECK(std::abs(result.psi(0) - 1.7 * 0.5 * std::sqrt(std::numbers::pi)) < 20 * 1e-8 * speed * (9 - 4.321));
}

// Beside a free load on a spring, whose stiffness is k and whose mass is 1.
TEST_CASE("a fast step of a drive is resolved in integrated runs", "[pulses]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri853", "dopri5", "radau5", "rodas4");
  const double eps = GENERATE(1e-3, 1e-5);
  const bool smooth = GENERATE(true, false);  // or its second derivative jumps where it begins and ends
  CAPTURE(method, eps, smooth);
  Scene scene = cart("0", 6, method);
  scene.bodies.push_back(plain_body("load", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.sensors = {point_sensor("x", "position", "cart", vec("0", "0", "0"), "x"),
                   point_sensor("u", "position", "load", vec("0", "0", "0"), "x")};
  PointForce pull;
  pull.body = "load", pull.components = {f("40*(x - u)"), f("0"), f("0")};
  scene.forces = {{"pull", pull}};
  Drive motor;
  motor.name = "motor", motor.type = "displacement", motor.joint = "slide";
  const std::string x = "(t - 2.3456)/" + std::to_string(eps), u = "min(1, max(0, 0.5 + " + x + "))";
  motor.law = f(smooth ? "0.05*P*(1 + tanh(" + x + "))" : "0.1*P*(3*(" + u + ")^2 - 2*(" + u + ")^3)");
  scene.drives = {motor};
  const double way = 0.1 * (1 - std::cos(std::sqrt(40.0) * (6 - 2.3456)));
  const Run r = run_of(scene, std::make_shared<Place>());
  CHECK(r.v == Approx(1.7 * way).epsilon(2e-4));
  CHECK(r.v_tlm == Approx(way).epsilon(2e-4));
  CHECK(r.v_adjoint == Approx(way).epsilon(2e-4));
}

TEST_CASE("blows among the samples of a signal are resolved", "[pulses]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri853", "dopri5", "radau5");
  const Interpolation how = GENERATE(Interpolation::hold, Interpolation::linear, Interpolation::spline);
  CAPTURE(method, static_cast<int>(how));
  Scene scene = cart("(40 + 1000*P*u)/P", 9, method);
  scene.signals = {blows(how, 1.0 / 2048, 9, 4, {1, 5000, 11311})};
  scene.parameters[0].value = 2;
  const Run r = run_of(scene);
  const Curve& u = *scene.signals[0].curve;
  double sum = 0;  // by Simpson's rule, exact between samples
  for (std::size_t i = 0; i + 1 < u.x().size(); ++i) {
    const double h = u.x()[i + 1] - u.x()[i], after = how == Interpolation::hold ? u.y()[i] : u.y()[i + 1];
    sum += h / 6 * (u.y()[i] + 4 * u.at(u.x()[i] + h / 2) + after);
  }
  CHECK(r.v == Approx(180 + 1000 * sum).epsilon(1e-7));
  CHECK(r.v_tlm == Approx(-90).epsilon(1e-6));
  CHECK(r.v_adjoint == Approx(-90).epsilon(1e-6));
}

TEST_CASE("fixed steps that pass over a blow name it", "[pulses]") {
  Scene scene = cart("10 + 900*u", 9, "rk4");
  scene.signals = {blows(Interpolation::linear, 1.0 / 2048, 9, 6, {7001})};
  const auto warnings = [&](double step) {
    scene.simulation.integrator.step = step;
    const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
    REQUIRE(result.ok());
    return simulation_warnings(scene, scene.simulation, result.statistics, true);
  };
  const std::vector<std::string> found = warnings(0.05);
  REQUIRE(found.size() == 1);
  CHECK_THAT(found[0], Contains("a pulse of signal 'u' near t = 3.42") && Contains("simulation.integrator.step"));
  CHECK(warnings(1e-3).empty());
}
