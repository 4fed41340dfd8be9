#include "core/driven/kinematics.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/kinematic_scene.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kCrank = 0.2, kRod = 0.7, kSpeed = 5;

Drive angle_drive(const std::string& joint, const std::string& law) {
  Drive d;
  d.name = "motor", d.type = "angle", d.joint = joint, d.law = f(law);
  return d;
}

// Slider-crank in x-y: crank about the origin, rod, slider along x with mass 2 kg; bars without mass and gravity, so
// that the torque follows from the slider alone.
Scene slider_of_crank() {
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1e-9, {1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.bodies.push_back(plain_body("rod", 1e-9, {1e-9, 1e-9, 1e-9, 0.0, 0.0, 0.0}, vec("0.2", "0", "0")));
  s.bodies.push_back(plain_body("slider", 2, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("0.9", "0", "0")));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", vec("0.2", "0", "0"), "rod", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "rod", vec("0.7", "0", "0"), "slider", vec("0", "0", "0")));
  Joint slide;
  slide.name = "guide", slide.type = "translational", slide.body2 = "slider";
  slide.axis1 = vec("1", "0", "0"), slide.axis2 = vec("1", "0", "0");
  s.joints.push_back(slide);
  s.sensors.push_back(point_sensor("x", "position", "slider", vec("0", "0", "0"), "x"));
  s.sensors.push_back(point_sensor("v", "velocity", "slider", vec("0", "0", "0"), "x"));
  s.sensors.push_back(point_sensor("a", "acceleration", "slider", vec("0", "0", "0"), "x"));
  return s;
}

std::vector<double> times(double end, int n) {
  std::vector<double> t;
  for (int i = 0; i <= n; ++i) t.push_back(end * i / n);
  return t;
}

}  // namespace

TEST_CASE("a driven slider-crank follows its closed form over two turns, torque included", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.drives.push_back(angle_drive("A", "5*t"));
  Sensor effort;
  effort.name = "torque", effort.quantity = "drive_force", effort.drive = "motor";
  scene.sensors.push_back(effort);
  const Mechanism mechanism(scene, VectorXd());
  double worst_x = 0, worst_v = 0, worst_a = 0, worst_T = 0;
  const SimulationResult result = solve_kinematics(
      mechanism, Assembly(mechanism, 0), {}, times(4 * std::numbers::pi / kSpeed, 97),
      [&](std::size_t, const StatePoint& at) {
        const double th = kSpeed * at.t, s = kCrank * std::sin(th), c = kCrank * std::cos(th);
        const double root = std::sqrt(kRod * kRod - s * s);
        // x = c + root,  root' = -s s'/root
        const double sd = kSpeed * c, cd = -kSpeed * s, sdd = -kSpeed * kSpeed * s, cdd = -kSpeed * kSpeed * c;
        const double rd = -s * sd / root, rdd = -(sd * sd + s * sdd + rd * rd) / root;
        const double x = c + root, v = cd + rd, a = cdd + rdd;
        worst_x = std::max(worst_x, std::abs(mechanism.sensor_value(0, at) - x));
        worst_v = std::max(worst_v, std::abs(mechanism.sensor_value(1, at) - v));
        worst_a = std::max(worst_a, std::abs(mechanism.sensor_value(2, at) - a));
        // power: T omega = m a v
        worst_T = std::max(worst_T, std::abs(mechanism.sensor_value(3, at) - 2 * a * v / kSpeed));
        return true;
      });
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(worst_x < 1e-13);
  CHECK(worst_v < 1e-12);
  CHECK(worst_a < 1e-10);
  CHECK(worst_T < 1e-7);  // the bars' own 1e-9 kg
  CHECK(result.statistics.max_position_violation < 1e-13);
}

TEST_CASE("a condition holds the degree of freedom that no drive holds", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.sensors.push_back(angle_sensor("theta", "A"));
  scene.conditions.push_back({"theta", f("0.3"), f("2")});
  std::vector<SceneIssue> issues;
  const Scene prescribed = kinematic_scene(scene, issues);
  CHECK(issues.empty());
  const Mechanism mechanism(prescribed, VectorXd());
  double last = 0;
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(1, 4), [&](std::size_t, const StatePoint& at) {
        last = mechanism.sensor_value(mechanism.sensor("theta"), at);
        return true;
      });
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(last == Approx(2.3).epsilon(1e-13));
}

TEST_CASE("what is not driven is said", "[kinematics]") {
  const Scene scene = slider_of_crank();
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(1, 2), [](std::size_t, const StatePoint&) {});
  CHECK_FALSE(result.ok());
  CHECK_THAT(result.message, Catch::Contains("1 degree of freedom: 'crank', 'rod', 'slider' move together"));
}

TEST_CASE("a drive too fast for the steps that are allowed fails at once, in words", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.drives.push_back(angle_drive("A", "1e19*t"));
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(1, 2), [](std::size_t, const StatePoint&) {});
  CHECK_FALSE(result.ok());
  CHECK(result.statistics.steps == 0);
  CHECK_THAT(result.message, Catch::Contains("max_steps"));
}

TEST_CASE("kinematics stops between two times that are wanted, too", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.drives.push_back(angle_drive("A", "100*t"));
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result = solve_kinematics(
      mechanism, Assembly(mechanism, 0), {}, times(1, 2), [](std::size_t, const StatePoint&) {},
      [](double t) { return t < 0.5; });
  CHECK_FALSE(result.ok());
  CHECK_THAT(result.message, Catch::Contains("stopped at t = 0.5"));
}

TEST_CASE("a drive that cannot pass a dead point fails with the time and the joints", "[kinematics]") {
  Scene scene = slider_of_crank();
  Drive push;
  push.name = "piston", push.type = "displacement", push.joint = "guide",
  push.law = f("0.8 + 0.2*t");  // 0.9: stretched
  scene.drives.push_back(push);
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(1, 10), [](std::size_t, const StatePoint&) {});
  CHECK_FALSE(result.ok());
  CHECK(result.last_good_time == Approx(0.5).margin(0.11));
  CHECK_THAT(result.message, Catch::Contains("cannot be continued"));
}

TEST_CASE("a parallelogram passes its flat positions on its branch, and they are named", "[kinematics]") {
  Scene scene;
  scene.gravity = {0.0, 0.0, 0.0};
  for (const char* name : {"left", "right", "bar"}) {
    scene.bodies.push_back(plain_body(name, 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  }
  scene.bodies[1].position = vec("2", "0", "0");
  scene.bodies[2].position = vec("0", "1", "0");
  for (int i : {0, 1}) scene.bodies[static_cast<std::size_t>(i)].orientation = turned("pi/2");
  scene.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "left", vec("0", "0", "0")));
  scene.joints.push_back(hinge("B", "ground", vec("2", "0", "0"), "right", vec("0", "0", "0")));
  scene.joints.push_back(hinge("C", "left", vec("1", "0", "0"), "bar", vec("0", "0", "0")));
  scene.joints.push_back(hinge("D", "right", vec("1", "0", "0"), "bar", vec("2", "0", "0")));
  scene.drives.push_back(angle_drive("A", "pi/2 + t"));
  scene.sensors.push_back(point_sensor("y", "position", "bar", vec("2", "0", "0"), "y"));
  scene.sensors.push_back(point_sensor("y0", "position", "bar", vec("0", "0", "0"), "y"));
  const Mechanism mechanism(scene, VectorXd());
  double tilt = 0;
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(6, 25), [&](std::size_t, const StatePoint& at) {
        tilt = std::max(tilt, std::abs(mechanism.sensor_value(0, at) - mechanism.sensor_value(1, at)));
        return true;
      });
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(tilt < 1e-9);  // the other branch would tilt the bar
}

// A slider-crank of crank and rod that its slider drives, from `gap` beside one of its two dead points and away from
// it. Largest error of the crank's angle, against the law of cosines.
double error_beside_a_dead_point(double crank, double rod, double gap, double speed, bool folded, int rows) {
  const double reach = folded ? rod - crank : rod + crank, away = folded ? 1 : -1, x0 = reach + away * gap * crank;
  const auto crank_angle = [&](double x) { return std::acos((crank * crank + x * x - rod * rod) / (2 * crank * x)); };
  const double th0 = crank_angle(x0), phi0 = std::asin(crank * std::sin(th0) / rod);
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  s.bodies.push_back(
      plain_body("rod", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, {crank * std::cos(th0), crank * std::sin(th0), 0.0}));
  s.bodies.push_back(plain_body("slider", 1, {0.01, 0.01, 0.01, 0.0, 0.0, 0.0}, {x0, 0.0, 0.0}));
  s.bodies[0].orientation = turned(fmt::format("{}", th0));
  s.bodies[1].orientation = turned(fmt::format("{}", -phi0));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", {crank, 0.0, 0.0}, "rod", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "rod", {rod, 0.0, 0.0}, "slider", vec("0", "0", "0")));
  Joint slide;
  slide.name = "guide", slide.type = "translational", slide.body2 = "slider";
  slide.axis1 = vec("1", "0", "0"), slide.axis2 = vec("1", "0", "0");
  s.joints.push_back(slide);
  Drive push;
  push.name = "piston", push.type = "displacement", push.joint = "guide";
  push.law = f(fmt::format("{} + {}*t", x0, away * speed));
  s.drives.push_back(push);
  s.sensors.push_back(angle_sensor("theta", "A"));
  const Mechanism mechanism(s, VectorXd());
  double worst = 0;
  const SimulationResult result = solve_kinematics(
      mechanism, Assembly(mechanism, 0), {}, times(0.5 * crank / speed, rows), [&](std::size_t, const StatePoint& at) {
        const double th = crank_angle(x0 + away * speed * at.t);
        worst = std::max(worst, std::abs(mechanism.sensor_value(0, at) - th));
        return true;
      });
  INFO(result.message);
  CHECK(result.ok());
  return worst;
}

TEST_CASE("a slider that moves away from a dead point stays on its branch", "[kinematics]") {
  int changed = 0;
  for (int i = 0; i < 150; ++i) {
    const double gap = std::pow(10, -3 + 2.0 * (i % 25) / 24), rod = i % 3 == 0 ? 0.5 : 1.3;
    const double worst = error_beside_a_dead_point(0.2, rod, gap, i % 2 == 0 ? 0.1 : 2, i >= 75, i % 2 == 0 ? 5 : 200);
    changed += worst < 1e-8 ? 0 : 1;
  }
  CHECK(changed == 0);
}

TEST_CASE("kinematics refuses a drive whose rate jumps in the words of a simulation", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.drives.push_back(angle_drive("A", "0.3 + 2*abs(t - 0.237)"));
  scene.simulation.end_time = 0.5;
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result = solve_kinematics(mechanism, Assembly(mechanism, 0), scene.simulation, times(0.5, 50),
                                                   [](std::size_t, const StatePoint&) {});
  CHECK_FALSE(result.ok());
  CHECK_THAT(result.message, Catch::Contains("changes its rate by 4 1/s at once at t = 0.237 s"));
  CHECK(result.last_good_time == Approx(0.23));
  CHECK(simulate(mechanism, scene.simulation).message == result.message);
}

TEST_CASE("kinematics of a body that no joint holds is refused", "[kinematics]") {
  Scene scene;
  scene.bodies.push_back(plain_body("stone", 1, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult result =
      solve_kinematics(mechanism, Assembly(mechanism, 0), {}, times(1, 2), [](std::size_t, const StatePoint&) {});
  CHECK_FALSE(result.ok());
  CHECK_THAT(result.message, Catch::Contains("6 degrees of freedom"));
}

TEST_CASE("conditions with an acceleration hold a degree of freedom, and so do Euler parameters", "[kinematics]") {
  Scene scene = slider_of_crank();
  scene.sensors.push_back(angle_sensor("theta", "A"));
  scene.conditions = {{"theta", f("0.4"), f("3"), f("-2")}};  // 0.4 + 3 t - t^2
  std::vector<SceneIssue> issues;
  const Mechanism driven(kinematic_scene(scene, issues), VectorXd());
  REQUIRE(issues.empty());
  const auto angle = [](double t) { return 0.4 + 3 * t - t * t; };
  std::vector<double> positions;
  const auto check = [&](std::size_t, const StatePoint& at) {
    const double c = angle(at.t), w = 3 - 2 * at.t, s = std::sin(c), k = std::cos(c);
    const double root = std::sqrt(kRod * kRod - kCrank * kCrank * s * s);
    const double root_c = -kCrank * kCrank * s * k / root;
    const double root_cc = (-kCrank * kCrank * (k * k - s * s) - root_c * root_c) / root;
    CHECK(driven.sensor_value(0, at) == Approx(kCrank * k + root).epsilon(1e-12));
    CHECK(driven.sensor_value(2, at) ==
          Approx((-kCrank * k + root_cc) * w * w - 2 * (-kCrank * s + root_c)).epsilon(1e-9));
    positions.push_back(driven.sensor_value(0, at));
    return true;
  };
  const std::vector<double> when = times(1.2, 6);
  CHECK(solve_kinematics(driven, Assembly(driven, 0), scene.simulation, when, check).ok());
  REQUIRE(positions.size() == when.size());

  // e3 = sin(angle/2) as the coordinate of the crank, at a constant rate
  Sensor e3;
  e3.name = "e3", e3.quantity = "orientation", e3.body = "crank", e3.component = "e3";
  scene.sensors.push_back(e3);
  scene.conditions = {{"e3", f("sin(0.2)"), f("0.5")}};
  const Mechanism by_parameter(kinematic_scene(scene, issues), VectorXd());
  REQUIRE(issues.empty());
  int seen = 0;
  const auto follow = [&](std::size_t, const StatePoint& at) {
    const double c = 2 * std::asin(std::sin(0.2) + 0.5 * at.t);
    CHECK(by_parameter.sensor_value(0, at) ==
          Approx(kCrank * std::cos(c) + std::sqrt(kRod * kRod - std::pow(kCrank * std::sin(c), 2))).epsilon(1e-11));
    ++seen;
    return true;
  };
  CHECK(solve_kinematics(by_parameter, Assembly(by_parameter, 0), scene.simulation, times(0.6, 4), follow).ok());
  CHECK(seen == 5);

  scene.conditions = {{"theta", f("0.4"), f("3"), f("-2")}};
  CHECK_THROWS_WITH(Mechanism(scene, VectorXd()), Catch::Contains("initial.conditions[0].acceleration"));
}
