#include "core/start/equilibrium.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "core/start/model_warnings.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// An arm on a hinge about y held by a torsional spring against its weight: k theta = m g c cos(theta).
Scene held_arm() {
  Scene s;
  add_parameters(s, {{"m", 2.0}, {"c", 0.5}, {"k", 30.0}, {"g", 9.81}});
  s.gravity = vec("0", "0", "-g");
  Body b = plain_body("arm", 1, {0.1, 0.2, 0.2, 0.0, 0.0, 0.0}, vec("0", "0", "0"));
  b.mass = f("m"), b.com = vec("c", "0", "0");
  s.bodies.push_back(b);
  Joint j = hinge("A", "ground", vec("0", "0", "0"), "arm", vec("0", "0", "0"));
  j.axis1 = vec("0", "1", "0"), j.axis2 = vec("0", "1", "0");
  s.joints.push_back(j);
  Rsda spring;
  spring.joint = "A", spring.stiffness = f("k"), spring.damping = 0.3;
  s.forces.push_back({"spring", spring});
  s.sensors.push_back(angle_sensor("theta", "A"));
  s.equilibrium = true;
  return s;
}

double sag(double m, double c, double k, double g) {  // k theta = m g c cos(theta), by Newton's method
  double theta = 0;
  for (int i = 0; i < 50; ++i) {
    theta -= (k * theta - m * g * c * std::cos(theta)) / (k + m * g * c * std::sin(theta));
  }
  return theta;
}

}  // namespace

TEST_CASE("an arm on a torsional spring starts where spring and weight balance", "[equilibrium]") {
  const Scene scene = held_arm();
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  const double theta = sag(2, 0.5, 30, 9.81);
  CHECK(assembly.result().angles(0) == Approx(theta).epsilon(1e-12));
  CHECK(assembly.result().y.tail(7).norm() == 0);
  // Its derivatives: (k + m g c sin) theta' = (m g c)' cos - k' theta
  const MatrixXd y_rho = assembly.tangent();
  const double slope = 30 + 2 * 9.81 * 0.5 * std::sin(theta);
  const double expected[] = {9.81 * 0.5 * std::cos(theta) / slope, 2 * 9.81 * std::cos(theta) / slope, -theta / slope,
                             2 * 0.5 * std::cos(theta) / slope};
  VectorXd y_bar = VectorXd::Zero(14), rho_bar = VectorXd::Zero(4);
  const VectorXd angles = assembly.result().angles;
  mechanism.add_sensor_gradient(0, {0, assembly.result().y, angles}, 1, y_bar, rho_bar);
  for (int k = 0; k < 4; ++k) CHECK(y_bar.dot(y_rho.col(k)) + rho_bar(k) == Approx(expected[k]).epsilon(1e-10));
}

TEST_CASE("a simulation from equilibrium stays there", "[equilibrium]") {
  Scene scene = held_arm();
  scene.simulation.end_time = 2;
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  CHECK((run.y_end - run.y_initial).lpNorm<Eigen::Infinity>() < 1e-10);
}

TEST_CASE("a closed loop hangs where its potential energy is least, and moves as differences say", "[equilibrium]") {
  Scene scene = four_bar();
  scene.gravity = {0.0, -9.81, 0.0};
  scene.equilibrium = true;
  Tsda spring;
  spring.body2 = "coupler", spring.point1 = vec("0.2", "1.5", "0"), spring.point2 = vec("L2/3", "0", "0");
  spring.stiffness = 25.0, spring.free_length = 0.3;
  scene.forces.push_back({"spring", spring});
  const VectorXd rho = nominal(scene);
  auto state = [&](const VectorXd& at) {
    const Assembly assembly(Mechanism(scene, at), 0);
    INFO(assembly.result().message);
    REQUIRE(assembly.result().ok);
    return assembly.result().y;
  };
  const VectorXd y = state(rho);
  const Mechanism mechanism(scene, rho);
  const MatrixXd y_rho = Assembly(mechanism, 0).tangent();
  for (int k = 0; k < rho.size(); ++k) {
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    const double h = 1e-4;
    VectorXd up = rho, down = rho;
    up(k) += h, down(k) -= h;
    const VectorXd difference = (state(up) - state(down)) / (2 * h);
    CHECK((y_rho.col(k) - difference).lpNorm<Eigen::Infinity>() < 1e-6 * (1 + y_rho.col(k).lpNorm<Eigen::Infinity>()));
  }
}

TEST_CASE("a body that nothing holds has no equilibrium, and the message names it", "[equilibrium]") {
  Scene scene;
  scene.bodies.push_back(plain_body("stone", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.equilibrium = true;
  const Assembly assembly(Mechanism(scene, VectorXd()), 0);
  CHECK_FALSE(assembly.result().ok);
  CHECK_THAT(assembly.result().message, Catch::Contains("static equilibrium not found"));
}

// A double pendulum of 1 m bars, the lower one ten times as heavy and on two springs, folded up at the start: on the
// way down the acceleration rises and falls.
Scene sprung_double_pendulum(double size) {
  Scene s;
  s.gravity = {0.0, -9.81 * size, 0.0};
  const double masses[] = {0.1, 1}, angles[] = {0.415, -1.47};
  double x = 0, y = 0;
  for (int i = 0; i < 2; ++i) {
    Body b = plain_body(i == 0 ? "upper" : "lower", masses[i], {0.01, 0.1, 0.1, 0.0, 0.0, 0.0}, {x, y, 0.0});
    b.inertia = {0.01 * size * size, 0.1 * size * size, 0.1 * size * size, 0.0, 0.0, 0.0};
    b.com = {0.5 * size, 0.0, 0.0};
    b.orientation = turned(fmt::format("{}", angles[i]));
    s.bodies.push_back(b);
    x += size * std::cos(angles[i]), y += size * std::sin(angles[i]);
  }
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "upper", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "upper", {size, 0.0, 0.0}, "lower", vec("0", "0", "0")));
  const double springs[2][5] = {{0.606, 1.155, 0.366, 12.16, 1.303}, {0.43, 1.069, 0.787, 62.95, 1.262}};
  for (const auto& [px, py, at, k, l0] : springs) {
    Tsda spring;
    spring.body2 = "lower", spring.point1 = VectorField{px * size, py * size, 0.0};
    spring.point2 = VectorField{at * size, 0.0, 0.0};
    spring.stiffness = k, spring.free_length = l0 * size;
    s.forces.push_back({"spring", spring});
  }
  s.equilibrium = true;
  s.simulation.end_time = 1;
  return s;
}

TEST_CASE("an equilibrium is found where the acceleration rises and falls on the way, at any size", "[equilibrium]") {
  const double size = GENERATE(1e-6, 1.0, 1e4);
  INFO(size << " m");
  const Scene scene = sprung_double_pendulum(size);
  const Mechanism mechanism(scene, VectorXd());
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  SimulationSettings settings = scene.simulation;
  settings.integrator.atol = 1e-8 * size;
  const SimulationResult run = simulate(mechanism, settings);  // stable: it stays
  REQUIRE(run.ok());
  for (const Eigen::Index body : {0, 7}) {
    const VectorXd moved = (run.y_end - run.y_initial).segment<7>(body);
    CHECK(moved.head<3>().lpNorm<Eigen::Infinity>() < 1e-7 * size);
    CHECK(moved.tail<4>().lpNorm<Eigen::Infinity>() < 1e-7);
  }
}

namespace {

// A toggle of links a and b, pressed open by a force F on its knee. Its pad touches a stop of stiffness k at x = gap,
// 60 mm beyond the guess.
struct Toggle {
  double a = 0.3, b = 0.25, F = 400, gap = 0.54;
  static constexpr double k = 2e6, kStart = 0.6;

  Scene scene() const {
    Scene s;
    add_parameters(s, {{"a", a}, {"b", b}, {"F", F}, {"gap", gap}});
    s.gravity = {0.0, 0.0, 0.0};
    const InertiaField inertia = {0.001, 0.002, 0.002, 0.0, 0.0, 0.0};
    const double knee = a * std::sin(kStart);
    s.bodies = {plain_body("first", 0.3, inertia, vec("0", "0", "0")),
                plain_body("second", 0.2, inertia, {a * std::cos(kStart), knee, 0.0}),
                plain_body("pad", 0.5, inertia, {a * std::cos(kStart) + std::sqrt(b * b - knee * knee), 0.0, 0.0})};
    s.bodies[0].com = vec("a/2", "0", "0"), s.bodies[0].orientation = turned(fmt::format("{}", kStart));
    s.bodies[1].com = vec("b/2", "0", "0"), s.bodies[1].orientation = turned(fmt::format("{}", -std::asin(knee / b)));
    Joint guide = hinge("G", "ground", vec("0", "0", "0"), "pad", vec("0", "0", "0"));
    guide.type = "translational", guide.axis1 = guide.axis2 = vec("1", "0", "0");
    s.joints = {hinge("O", "ground", vec("0", "0", "0"), "first", vec("0", "0", "0")),
                hinge("K", "first", vec("a", "0", "0"), "second", vec("0", "0", "0")),
                hinge("S", "second", vec("b", "0", "0"), "pad", vec("0", "0", "0")), guide};
    PointForce hand;
    hand.body = "first", hand.point = vec("a", "0", "0");
    hand.components = {Expression::parse("0"), Expression::parse("-F"), Expression::parse("0")};
    Tsda stop;
    stop.body2 = "pad", stop.point1 = vec("1", "0", "0");
    stop.law = Expression::parse("-2e6*max(0, 1 - gap - l)");
    s.forces = {{"hand", hand}, {"stop", stop}};
    s.equilibrium = true;
    return s;
  }

  double pad(double angle) const { return a * std::cos(angle) + std::sqrt(b * b - std::pow(a * std::sin(angle), 2)); }
  // Where F a cos(angle) = -k (x - gap) dx/d(angle) for the first time on the way from the start, by bisection.
  double rest() const {
    const auto opens = [&](double angle) {
      const double s = std::sin(angle), c = std::cos(angle);
      const double slope = -a * s - a * a * s * c / std::sqrt(b * b - a * a * s * s);
      return F * a * c > -k * std::max(0.0, pad(angle) - gap) * slope;
    };
    double high = kStart;
    while (opens(high - 1e-3)) high -= 1e-3;
    double low = high - 1e-3;
    for (int i = 0; i < 60; ++i) (opens(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
    return pad(low);
  }
};

std::vector<std::string> warnings_at_start(const Scene& scene) {
  const Mechanism mechanism(scene, nominal(scene));
  return model_warnings(mechanism, Assembly(mechanism, 0));
}

// A heavy arm on a hinge with a law; `start` is its angle.
Scene arm_with_law(const std::string& law, double start, double m = 1) {
  Scene s;
  add_parameters(s, {{"m", m}});
  s.gravity = {0.0, -9.81, 0.0};
  Body b = plain_body("arm", 1, {0.02, 0.02, 0.02, 0.0, 0.0, 0.0}, vec("0", "0", "0"));
  b.mass = f("m"), b.com = vec("0.3", "0", "0"), b.orientation = turned(fmt::format("{}", start));
  s.bodies.push_back(b);
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "arm", vec("0", "0", "0")));
  Rsda spring;
  spring.joint = "pin", spring.law = Expression::parse(law);
  s.forces.push_back({"law", spring});
  s.sensors.push_back(angle_sensor("angle", "pin"));
  s.equilibrium = true;
  s.simulation.end_time = 0.5;
  return s;
}

double angle_at_rest(const Scene& scene) {
  const Assembly assembly(Mechanism(scene, nominal(scene)), 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  return assembly.result().angles(0);
}

}  // namespace

TEST_CASE("a toggle pressed against a stop beyond its guess rests on the side from which it comes", "[equilibrium]") {
  Toggle toggle;
  toggle.gap = GENERATE(0.5, 0.52, 0.54, 0.545);  // straight: 0.55
  const Scene scene = toggle.scene();
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  CHECK(assembly.result().y(14) == Approx(toggle.rest()).epsilon(1e-10));
  CHECK(model_warnings(mechanism, assembly).empty());
  const Eigen::RowVectorXd x_rho = assembly.tangent().row(14);
  double Toggle::*const fields[] = {&Toggle::a, &Toggle::b, &Toggle::F, &Toggle::gap};
  for (int k = 0; k < 4; ++k) {
    Toggle up = toggle, down = toggle;
    const double h = 1e-4 * toggle.*fields[k];
    up.*fields[k] += h, down.*fields[k] -= h;
    CHECK(x_rho(k) == Approx((up.rest() - down.rest()) / (2 * h)).epsilon(1e-4));
  }
}

TEST_CASE("a toggle that no stop holds snaps through", "[equilibrium]") {
  Toggle toggle;
  toggle.gap = 0.56;
  const Scene scene = toggle.scene();
  const Assembly assembly(Mechanism(scene, nominal(scene)), 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  CHECK(assembly.result().y(14) < 0.5);
  CHECK(assembly.result().y(1) < 0);  // its knee is below
}

TEST_CASE("an arm falls from near the top to the side on which it leans, and stays", "[equilibrium]") {
  const double lean = GENERATE(1e-7, 1e-3, 0.5);
  const std::string stop = "-30000*max(0, -angle)";
  CHECK(angle_at_rest(arm_with_law(stop, M_PI / 2 - lean)) == Approx(-0.3 * 9.81 / 30000).epsilon(1e-8));
  const Scene beyond = arm_with_law(stop, M_PI / 2 + lean);
  CHECK(angle_at_rest(beyond) == Approx(1.5 * M_PI).epsilon(1e-12));
  const Mechanism mechanism(beyond, nominal(beyond));
  const SimulationResult run = simulate(mechanism, beyond.simulation);
  REQUIRE(run.ok());
  CHECK((run.y_end - run.y_initial).lpNorm<Eigen::Infinity>() < 1e-9);
  CHECK(warnings_at_start(beyond).empty());
}

TEST_CASE("an unstable equilibrium is kept if the guess is on it, and named", "[equilibrium]") {
  const Scene top = arm_with_law("2*angle*0", M_PI / 2);
  CHECK(angle_at_rest(top) == Approx(M_PI / 2).epsilon(1e-12));
  const std::vector<std::string> warnings = warnings_at_start(top);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::Contains("unstable") && Catch::Contains("'arm'"));
}

TEST_CASE("an arm rests in the first of several wells on its way", "[equilibrium]") {
  // Wells of 0.08 rad at -0.6 and -1.2, deeper than the weight needs; the first is met first.
  const std::string wells =
      "8*(angle + 0.6)/0.08*exp(-((angle + 0.6)/0.08)^2) + "
      "8*(angle + 1.2)/0.08*exp(-((angle + 1.2)/0.08)^2)";
  const double angle = angle_at_rest(arm_with_law(wells, GENERATE(1.4, 0.2, -0.45)));
  CHECK(std::abs(angle + 0.6) < 0.08);
  const double x = (angle + 0.6) / 0.08;
  CHECK(8 * x * std::exp(-x * x) == Approx(-0.3 * 9.81 * std::cos(angle)).epsilon(1e-8));
}

TEST_CASE("a narrow catch on a way of constant force is not passed over", "[equilibrium]") {
  // 3 kg slide down a rail; a catch of twice 4 mm holds them at 0.7 m, or a smooth one of 3 mm. Below is a stop.
  const bool smooth = GENERATE(false, true);
  const double from = GENERATE(0.0, 0.61);
  Scene s;
  s.bodies.push_back(plain_body("ram", 3, {1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, vec("0", "0", Expression(-from).text())));
  Joint rail;
  rail.name = "rail", rail.type = "translational", rail.body2 = "ram";
  rail.axis1 = vec("0", "0", "-1"), rail.axis2 = vec("0", "0", "-1");
  s.joints.push_back(rail);
  Sensor down;
  down.name = "down", down.quantity = "displacement", down.joint = "rail";
  s.sensors.push_back(down);
  const std::string held = smooth ? "200*exp(-((down - 0.7)/0.003)^2)" : "80*max(0, 1 - abs(down - 0.7)/0.004)";
  PointForce force;
  force.body = "ram";
  force.components = {f("0"), f("0"), f(held + " + 1e5*max(0, down - 2)")};
  s.forces.push_back({"catch", force});
  s.equilibrium = true;
  const Mechanism mechanism(s, nominal(s));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  const double weight = 3 * 9.81;
  const double rest = smooth ? 0.7 - 0.003 * std::sqrt(std::log(200 / weight)) : 0.7 - 0.004 * (1 - weight / 80);
  CHECK(-assembly.result().y(2) == Approx(rest).epsilon(1e-10));
}

TEST_CASE("an equilibrium at or beside a kink of a force is found from either side", "[equilibrium]") {
  // The spring holds m = 1 kg at angle 0, where its slope changes from 10 to 20 N m/rad.
  const std::string law = "table(angle, [-1, 0, 1], [-12.943, -2.943, 17.057])";
  for (const double m : {0.99, 1.0, 1.01}) CHECK(warnings_at_start(arm_with_law(law, 0.2, m)).empty());
  const double angle = angle_at_rest(arm_with_law(law, GENERATE(-0.8, 0.8), 1.01));
  CHECK(10 * angle == Approx(0.3 * 9.81 * (1 - 1.01 * std::cos(angle))).epsilon(1e-8));
}
