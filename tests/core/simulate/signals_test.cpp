// Signals in the laws of forces: their steps, their exactness, their derivatives.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/issues.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;
using Eigen::VectorXd;

namespace {

Signal signal(Interpolation how, std::vector<double> t, std::vector<double> y) {
  Signal s;
  s.name = "u", s.interpolation = how;
  s.curve = std::make_shared<const Curve>(how, std::move(t), std::move(y));
  return s;
}

// A mass of 1 kg on a slide along x, pushed by the signal u [N].
Scene pushed(const Signal& u) {
  Scene s = pushed_cart("u", 2, 1e-8);
  s.signals = {u};
  return s;
}

SimulationResult simulated(const Scene& scene) {
  const SimulationResult result = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  INFO(result.message);
  REQUIRE(result.ok());
  return result;
}

// x and its rate at the end, from rest, under the force u: integrals of its pieces.
std::pair<double, double> closed_form(const Curve& u, double end) {
  double x = 0, v = 0;
  for (std::size_t i = 0; i + 1 < u.x().size() && u.x()[i] < end; ++i) {
    const double h = std::min(u.x()[i + 1], end) - u.x()[i], a = u.y()[i];
    const double slope = u.interpolation() == Interpolation::hold ? 0 : u.at(u.x()[i], 1);
    x += h * v + h * h / 2 * a + h * h * h / 6 * slope;
    v += h * a + h * h / 2 * slope;
  }
  return {x, v};
}

// Repeatable noise of size 1.
std::vector<double> noise(std::size_t n) {
  std::vector<double> y;
  double x = 20261;
  for (std::size_t i = 0; i < n; ++i) x = std::fmod(16807 * x, 2147483647.0), y.push_back(2 * x / 2147483647 - 1);
  return y;
}

std::vector<double> times(std::size_t n, double end) {
  std::vector<double> t;
  for (std::size_t i = 0; i < n; ++i) t.push_back(end * static_cast<double>(i) / static_cast<double>(n - 1));
  return t;
}

}  // namespace

TEST_CASE("steps meet the kinks of hold and linear: the motion is that of the closed form", "[signals]") {
  const Interpolation how = GENERATE(Interpolation::hold, Interpolation::linear);
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "radau5");
  const std::vector<double> t{0, 0.31, 0.5, 0.77, 1.3, 1.31, 2}, y{4, -3, 2, 7, -8, 5, 1};
  Scene scene = pushed(signal(how, t, y));
  scene.simulation.integrator.type = method;
  const SimulationResult result = simulated(scene);
  const auto [x, v] = closed_form(*scene.signals[0].curve, 2);
  // Within pieces the motion is a cubic, on which both methods are exact.
  CHECK(result.y_end(0) == Approx(x).margin(1e-8));
  CHECK(result.y_end(7) == Approx(v).margin(1e-8));
  CHECK(result.statistics.rejected <= 8);
}

TEST_CASE("fixed steps end at kinks, too", "[signals]") {
  Scene scene = pushed(signal(Interpolation::hold, times(21, 2), noise(21)));
  scene.simulation.integrator.type = "rk4", scene.simulation.integrator.step = 0.1;
  const SimulationResult result = simulated(scene);
  const auto [x, v] = closed_form(*scene.signals[0].curve, 2);
  CHECK(result.y_end(0) == Approx(x).margin(1e-12));
  CHECK(result.y_end(7) == Approx(v).margin(1e-12));
  CHECK(result.statistics.steps == 20);
}

TEST_CASE("200 samples that matter cost about a step each", "[signals]") {
  Scene scene = pushed(signal(Interpolation::linear, times(201, 2), noise(201)));
  const SimulationResult result = simulated(scene);
  const auto [x, v] = closed_form(*scene.signals[0].curve, 2);
  CHECK(result.y_end(7) == Approx(v).margin(1e-7));
  INFO(result.statistics.steps << " steps, " << result.statistics.rejected << " rejected");
  CHECK(result.statistics.steps + result.statistics.rejected < 260);
}

TEST_CASE("100000 samples whose kinks are below the tolerance cost no steps of their own", "[signals]") {
  const std::size_t n = 100001;
  const std::vector<double> t = times(n, 2), e = noise(n);
  std::vector<double> y;
  for (std::size_t i = 0; i < n; ++i) y.push_back(std::sin(3 * t[i]) + 1e-7 * e[i]);
  Scene scene = pushed(signal(Interpolation::linear, t, y));
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  const SimulationResult result = simulated(scene);
  const auto [x, v] = closed_form(*scene.signals[0].curve, 2);
  CHECK(result.y_end(7) == Approx(v).margin(1e-6));
  INFO(result.statistics.steps << " steps, " << result.statistics.rejected << " rejected");
  CHECK(result.statistics.steps + result.statistics.rejected < 100);
}

TEST_CASE("steps meet the kinks of a table of time as those of a linear signal", "[signals]") {
  const std::vector<double> t{0, 0.31, 0.5, 0.77, 1.3, 1.31, 2}, y{4, -3, 2, 7, -8, 5, 1};
  const auto [x, v] = closed_form(Curve(Interpolation::linear, t, y), 2);
  Scene scene = pushed(signal(Interpolation::linear, {0, 2}, {0, 0}));
  add_parameters(scene, {{"p", 7.0}, {"late", 0.25}});
  const auto components = [&](const std::string& law) {
    std::get<PointForce>(scene.forces[0].kind).components[0] = f(law);
  };
  SECTION("its values are numbers or parameters") {
    components(GENERATE(as<std::string>{}, "table(t, [0, 0.31, 0.5, 0.77, 1.3, 1.31, 2], [4, -3, 2, 7, -8, 5, 1])",
                        "table(t, [0, 0.31, 0.5, 0.77, 1.3, 1.31, 2], [4, -3, 2, p, -p - 1, 5, 1])"));
  }
  SECTION("its argument is late, stretched, or runs backwards") {
    components(GENERATE(as<std::string>{},
                        "table(t - late, [-0.25, 0.06, 0.25, 0.52, 1.05, 1.06, 1.75], [4, -3, 2, 7, -8, 5, 1])",
                        "table(10*t + 4*late, [1, 4.1, 6, 8.7, 14, 14.1, 21], [4, -3, 2, 7, -8, 5, 1])",
                        "table(-t, [-2, -1.31, -1.3, -0.77, -0.5, -0.31, 0], [1, 5, -8, 7, 2, -3, 4])"));
  }
  const SimulationResult result = simulated(scene);
  CHECK(result.y_end(0) == Approx(x).margin(1e-8));
  CHECK(result.y_end(7) == Approx(v).margin(1e-8));
  CHECK(result.statistics.rejected <= 8);
}

TEST_CASE("steps meet the knots of a spline that the tolerance sees", "[signals]") {
  Scene scene = pushed(signal(Interpolation::spline, times(201, 2), noise(201)));
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-10, scene.simulation.integrator.atol = 1e-12;
  const SimulationResult result = simulated(scene);
  // Integrals of the pieces, cubics, by Taylor's series.
  const Curve& u = *scene.signals[0].curve;
  double x = 0, v = 0;
  for (std::size_t i = 0; i < 200; ++i) {
    const double h = u.x()[i + 1] - u.x()[i], at = u.x()[i];
    double x_h = x + h * v, v_h = v, power = h;
    for (int k = 0; k <= 3; ++k) {
      v_h += power / (k + 1) * u.at(at, k), x_h += power * h / ((k + 1) * (k + 2)) * u.at(at, k);
      power *= h / (k + 1);
    }
    x = x_h, v = v_h;
  }
  CHECK(result.y_end(0) == Approx(x).margin(1e-10));
  CHECK(result.y_end(7) == Approx(v).margin(1e-10));
  INFO(result.statistics.steps << " steps, " << result.statistics.rejected << " rejected");
  CHECK(result.statistics.steps + result.statistics.rejected < 260);
}

TEST_CASE("knots of a smooth spline cost no steps of their own", "[signals]") {
  std::vector<double> y;
  for (const double t : times(2001, 2)) y.push_back(std::sin(3 * t));
  Scene scene = pushed(signal(Interpolation::spline, times(2001, 2), y));
  const SimulationResult result = simulated(scene);
  CHECK(result.y_end(7) == Approx((1 - std::cos(6)) / 3).margin(1e-8));
  INFO(result.statistics.steps << " steps, " << result.statistics.rejected << " rejected");
  CHECK(result.statistics.steps + result.statistics.rejected < 100);
}

TEST_CASE("steps meet the knots of a drive's spline, its acceleration's kinks", "[signals][drives]") {
  const std::size_t n = 101;
  Scene scene = pushed(signal(Interpolation::spline, times(n, 2), noise(n)));
  Body free = scene.bodies[0];  // hangs on the driven cart by a spring: nothing that is solved in place of integrated
  free.name = "free";
  scene.bodies.push_back(free);
  Joint slide = scene.joints[0];
  slide.name = "slide2", slide.body2 = "free";
  scene.joints.push_back(slide);
  std::get<PointForce>(scene.forces[0].kind).components[0] = f("0");
  Drive drive;
  drive.name = "play", drive.type = "displacement", drive.joint = "slide", drive.law = f("u");
  scene.drives = {drive};
  const SimulationResult result = simulated(scene);
  const Curve& u = *scene.signals[0].curve;
  CHECK(result.y_end(0) == Approx(u.at(2)).margin(1e-8));
  CHECK(result.y_end(14) == Approx(u.at(2, 1)).margin(1e-6));
  INFO(result.statistics.steps << " steps, " << result.statistics.rejected << " rejected");
  CHECK(result.statistics.steps + result.statistics.rejected < 400);
}

TEST_CASE("gain, offset and delay have exact derivatives: TLM = adjoint = differences", "[signals]") {
  const Interpolation how = GENERATE(Interpolation::linear, Interpolation::spline);
  Scene scene = double_pendulum();
  const std::size_t first = scene.parameters.size();
  add_parameters(scene, {{"gain", 3.0}, {"late", 0.04}, {"zero", 0.3}});
  Signal u = signal(how, {-1, 0, 0.1, 0.2, 0.3, 0.4, 0.6}, {1, 1, -2, 3, 0.5, -1, 2});
  u.gain = f("gain"), u.delay = f("late"), u.offset = f("zero");
  scene.signals = {u};
  Torque motor;
  motor.body = "upper", motor.components = {f("0"), f("0"), f("u")};
  scene.forces.push_back({"motor", motor});
  scene.simulation.end_time = 0.5;
  scene.simulation.integrator.rtol = 1e-10, scene.simulation.integrator.atol = 1e-12;
  Cost cost;
  cost.running = cost.terminal = std::make_shared<StateNorm>();
  const std::vector<Cost> costs{cost};
  const VectorXd rho = nominal(scene);
  const SimulationResult tlm = simulate_tlm(Mechanism(scene, rho), scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(Mechanism(scene, rho), scene.simulation, costs);
  REQUIRE((tlm.ok() && adjoint.ok()));
  CHECK((tlm.psi_rho - adjoint.psi_rho).cwiseAbs().maxCoeff() < 1e-9 * tlm.psi_rho.cwiseAbs().maxCoeff());
  for (std::size_t k = first; k < scene.parameters.size(); ++k) {
    // On the same steps the function is the same. A delay moves the kinks to which steps belong, so its steps are new:
    // their errors of some 1e-10 over h, and h^2 at kinks, are 1e-5 of the derivative.
    const bool moves = scene.parameters[k].name == "late";
    const double h = moves ? 1e-3 : 1e-4;
    RunOptions options;
    if (!moves) options.frozen = &tlm.steps;
    const auto psi = [&](double change) {
      VectorXd at = rho;
      at(static_cast<Eigen::Index>(k)) += change;
      return simulate(Mechanism(scene, at), scene.simulation, costs, {}, options).psi(0);
    };
    const double difference = (8 * (psi(h) - psi(-h)) - (psi(2 * h) - psi(-2 * h))) / (12 * h);
    INFO(scene.parameters[k].name);
    CHECK(tlm.psi_rho(0, static_cast<Eigen::Index>(k)) == Approx(difference).epsilon(moves ? 1e-5 : 1e-8));
    CHECK(difference != 0);
  }
}

TEST_CASE("what a signal cannot do is refused in words", "[signals]") {
  SECTION("samples that do not cover the run") {
    Scene scene = pushed(signal(Interpolation::linear, {0, 1}, {0, 1}));
    CHECK_THROWS_WITH(Mechanism(scene, nominal(scene)),
                      Contains("signals.u: its samples cover 0 s to 1 s, the simulation 0 s to 2 s"));
    scene = pushed(signal(Interpolation::linear, {0, 3}, {0, 1}));
    scene.signals[0].delay = 0.5;
    CHECK_THROWS_WITH(Mechanism(scene, nominal(scene)), Contains("cover 0.5 s to 3.5 s"));
  }
  SECTION("hold, moved by a parameter that is varied") {
    Scene scene = pushed(signal(Interpolation::hold, {-1, 1, 2}, {0, 1, 2}));
    add_parameters(scene, {{"late", 0.1}});
    scene.signals[0].delay = f("late");
    CHECK_THROWS_WITH(Mechanism(scene, nominal(scene)), Contains("signals.u.delay") && Contains("hold jumps"));
    CHECK_NOTHROW(Mechanism(scene, nominal(scene), {false}));
  }
  SECTION("a drive along kinks") {
    Scene scene = pushed(signal(Interpolation::linear, {0, 2}, {0, 1}));
    Drive drive;
    drive.name = "motor", drive.type = "displacement", drive.joint = "slide", drive.law = f("u + 1");
    scene.drives = {drive};
    const std::vector<SceneIssue> issues = find_issues(scene);
    REQUIRE(issues.size() == 1);
    CHECK(issues[0].path == "drives[0].law");
    CHECK_THAT(issues[0].message, Contains("the signal 'u', which has kinks") && Contains("spline"));
    scene.signals[0].interpolation = Interpolation::spline;
    CHECK(find_issues(scene).empty());
    scene.drives[0].law = f("table(t, [0, 2], [0, 1])");
    CHECK_THAT(find_issues(scene).at(0).message, Contains("has a table"));
  }
  SECTION("a name that is taken, and a field that knows no time") {
    Scene scene = pushed(signal(Interpolation::linear, {0, 2}, {0, 1}));
    add_parameters(scene, {{"u", 1.0}});
    CHECK_THAT(find_issues(scene).at(0).message, Contains("the name 'u' is taken by parameters.u"));
    scene = pushed(signal(Interpolation::linear, {0, 2}, {0, 1}));
    scene.bodies[0].mass = f("u");
    CHECK_THAT(find_issues(scene).at(0).message, Contains("unknown name 'u'"));
  }
}

TEST_CASE("the delay of a spline that a drive follows moves kinks of its acceleration", "[signals]") {
  Signal u = signal(Interpolation::spline, {-1, 0.3, 0.7, 1.1, 3}, {0, 1, -1, 2, 0});
  u.delay = f("late");
  Scene scene = pushed(u);
  add_parameters(scene, {{"late", 0.1}});
  Drive drive;
  drive.name = "drive", drive.type = "displacement", drive.joint = "slide", drive.law = f("0.2*u");
  scene.drives = {drive};
  const std::vector<KinkedSignal> kinks = Mechanism(scene, nominal(scene)).data().kinks;
  REQUIRE(kinks.size() == 1);
  CHECK(kinks[0].order == 1);
  CHECK(kinks[0].moved_by == std::vector<int>{0});
}
