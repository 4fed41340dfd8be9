#include "core/start/assembly.hpp"

#include <numbers>

#include <catch2/catch.hpp>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "tests/core/start/assembled.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kPi = std::numbers::pi;

// Angle about z of a body turned in the plane.
double turn(const AssemblyResult& a, int body) {
  const Vector4d p = a.y.segment<4>(7 * body + 3);
  return 2 * std::atan2(p(3), p(0));
}

}  // namespace

TEST_CASE("a pendulum is set to the angle and rate that its condition asks for", "[assembly]") {
  Scene scene = pendulum();
  scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(a.residual < 1e-15);
  CHECK(a.angles(0) == Approx(0.4).margin(1e-15));
  VectorXd expected(14);
  const double C = std::cos(0.4), S = std::sin(0.4), w = -1.5;
  expected << 0.7 * C, 0.7 * S, 0, std::cos(0.2), 0, 0, std::sin(0.2),  //
      -0.7 * w * S, 0.7 * w * C, 0, -w / 2 * std::sin(0.2), 0, 0, w / 2 * std::cos(0.2);
  CHECK((a.y - expected).lpNorm<Eigen::Infinity>() < 4e-16);
}

TEST_CASE("an angle is met modulo a full turn and then counted on the condition's turn", "[assembly]") {
  Scene scene = pendulum();
  scene.conditions.push_back(value_of("theta", "7"));
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(a.angles(0) == Approx(7).margin(1e-14));
  CHECK(turn(a, 0) == Approx(7 - 2 * kPi).margin(1e-14));

  scene.conditions[0] = value_of("theta", "-20");
  const AssemblyResult b = assemble(scene);
  REQUIRE(b.ok);
  CHECK(b.angles(0) == Approx(-20).margin(1e-14));
}

TEST_CASE("a condition on an expression of angles holds on the turns that it starts with", "[assembly]") {
  Scene scene = pendulum();
  scene.sensors.push_back(expression_sensor("twice", "2*theta"));
  scene.conditions.push_back(value_of("twice", "7"));
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(a.angles(0) == Approx(3.5).margin(1e-13));  // more than half a turn

  // The angle's own condition names its turn, and the square's rate is 2 theta thetadot.
  scene.sensors.back() = expression_sensor("square", "theta^2");
  scene.conditions = {value_of("theta", "7"), {"square", {}, f("14")}};
  const AssemblyResult b = assemble(scene);
  REQUIRE(b.ok);
  CHECK(b.angles(0) == Approx(7).margin(1e-14));
  CHECK(2 * b.y.segment<4>(10).norm() == Approx(1).margin(1e-13));
}

TEST_CASE("an angle is reached the short way round, across half a turn, and from exactly opposite", "[assembly]") {
  Scene scene = pendulum();
  scene.parameters[1].value = 3.0;  // the guess
  scene.conditions.push_back(value_of("theta", "-3"));
  const AssemblyResult across = assemble(scene);
  REQUIRE(across.ok);
  CHECK(across.iterations < 10);
  CHECK(across.angles(0) == Approx(-3).margin(1e-14));

  scene.parameters[1].value = -0.1;
  scene.conditions[0] = value_of("theta", "pi-0.1");
  const AssemblyResult opposite = assemble(scene);
  REQUIRE(opposite.ok);
  CHECK(opposite.angles(0) == Approx(kPi - 0.1).margin(1e-14));
}

TEST_CASE("a joint may name the ground second", "[assembly]") {
  Scene scene = pendulum();
  std::swap(scene.joints[0].body1, scene.joints[0].body2);
  scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(turn(a, 0) == Approx(-0.4).margin(1e-14));  // the angle runs from body1 to body2
  check_derivatives(scene);
}

TEST_CASE("a free body starts at its guess, and follows it", "[assembly]") {
  Scene scene = spatial_four_bar();
  scene.joints.clear();
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  check_derivatives(scene);
}

TEST_CASE("an angle without a condition is atan2's own value", "[assembly]") {
  Scene scene = pendulum();
  scene.parameters[1].value = 3.0;
  CHECK(assemble(scene).angles(0) == Approx(3.0).margin(1e-14));
  scene.parameters[1].value = 4.0;
  CHECK(assemble(scene).angles(0) == Approx(4.0 - 2 * kPi).margin(1e-14));
}

TEST_CASE("a guess that satisfies everything is kept to the last digit", "[assembly]") {
  const Scene scene = double_pendulum();
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  for (int i = 0; i < 2; ++i) {
    CHECK((assembly.result().y.segment<7>(7 * i) - mechanism.data().bodies[static_cast<std::size_t>(i + 1)].q)
              .lpNorm<Eigen::Infinity>() < 2e-16);
  }
}

TEST_CASE("the body a condition leaves free goes to the nearest place, not to where it hangs best", "[assembly]") {
  Scene scene = double_pendulum();
  scene.conditions.push_back(value_of("theta1", "theta0"));
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  // The lower bar's angle b minimises |r(b) - r_guess|^2 + |p(b) - p_guess|^2 with its hinge at the upper bar's tip:
  //   E(b) = const + c2 (tip - r_guess)'(cos b, sin b) - cos((b - a2)/2)       (half the square, unit p)
  // minimised here by bisection of dE/db.
  const double tip_x = std::cos(0.9), tip_y = std::sin(0.9);
  const double gx = std::cos(0.3) + 0.6 * std::cos(-0.5), gy = std::sin(0.3) + 0.6 * std::sin(-0.5);
  auto slope = [&](double b) {
    return 0.6 * (-(tip_x - gx) * std::sin(b) + (tip_y - gy) * std::cos(b)) + 0.5 * std::sin((b + 0.5) / 2);
  };
  double low = -2, high = 1;
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (low + high);
    (slope(middle) > 0 ? high : low) = middle;
  }
  CHECK(turn(a, 0) == Approx(0.9).margin(1e-14));
  CHECK(turn(a, 1) == Approx(low).margin(1e-13));
  CHECK(std::abs(low + 0.5) > 0.1);  // not simply the guess
}

TEST_CASE("a guess far outside a link's reach is pulled in along the shortest way", "[assembly]") {
  // Distance 5 from the hinge on a bar of c = 0.7: the tangential curvature is six times that of the guess's metric.
  Scene scene = pendulum();
  scene.bodies[0].position = vec("3", "4", "0");
  scene.bodies[0].orientation = turned("1.4");
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(a.residual < 1e-15);
  CHECK(a.iterations < 60);
  // dE/db of E = 1/2 |r - r_guess|^2 + 1/2 |p - p_guess|^2
  const double gx = 3 + 0.7 * std::cos(1.4), gy = 4 + 0.7 * std::sin(1.4), b = turn(a, 0);
  CHECK(0.7 * (gx * std::sin(b) - gy * std::cos(b)) + 0.5 * std::sin((b - 1.4) / 2) == Approx(0).margin(1e-14));
}

TEST_CASE("a four-bar closes from a rough guess, at the conditioned crank angle", "[assembly]") {
  Scene scene = four_bar();
  scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  CHECK(a.residual < 1e-14);
  // The loop in closed form: rocker angle from the triangle over the crank's tip.
  const double theta = 1.3, L1 = 0.5, L2 = 1.2, L3 = 0.9, d = 1.0;
  const double x = L1 * std::cos(theta) - d, y = L1 * std::sin(theta), e = std::hypot(x, y);
  const double rocker = std::atan2(y, x) - std::acos((e * e + L3 * L3 - L2 * L2) / (2 * e * L3));
  CHECK(turn(a, 2) == Approx(rocker).margin(1e-13));
  const double coupler = std::atan2(L3 * std::sin(rocker) - y, d + L3 * std::cos(rocker) - L1 * std::cos(theta));
  CHECK(turn(a, 1) == Approx(coupler).margin(1e-13));
  // Its velocities: omega3 = omega1 L1 sin(theta - coupler)/(L3 sin(rocker - coupler))
  const double w3 = 2.0 * L1 * std::sin(theta - coupler) / (L3 * std::sin(rocker - coupler));
  const Vector4d p = a.y.segment<4>(17), pdot = a.y.segment<4>(21 + 17);
  CHECK(omega_B(p, pdot)(2) == Approx(w3).margin(1e-13));
}

TEST_CASE("redundant equations of a planar loop are counted at the joint that closes it", "[assembly]") {
  const Scene scene = four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  const ModelSummary s = assembly.summary();
  CHECK(s.bodies == 3);
  CHECK(s.equations == 23);
  CHECK(s.rank == 20);
  CHECK(s.degrees_of_freedom == 1);
  CHECK(s.redundant == std::vector<std::string>{"D (3 of 5)"});
}

TEST_CASE("a spatial loop has no redundant equation and keeps its coupler's spin", "[assembly]") {
  const Scene scene = spatial_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  const ModelSummary s = assembly.summary();
  CHECK(s.equations == 19);
  CHECK(s.degrees_of_freedom == 2);
  CHECK(s.redundant.empty());
}

TEST_CASE("velocities are the nearest ones that joints and conditions allow", "[assembly]") {
  Scene scene = double_pendulum();
  scene.conditions.push_back(rate_of("theta2", "3"));
  const AssemblyResult a = assemble(scene);
  REQUIRE(a.ok);
  // Relative rate 3, the upper bar's rate w free: minimises the squared distance, linear in w, from the guess.
  auto velocity = [&](double w) {
    const double u = w + 3;
    VectorXd v(14);
    v << -0.4 * w * std::sin(0.3), 0.4 * w * std::cos(0.3), 0, -w / 2 * std::sin(0.15), 0, 0, w / 2 * std::cos(0.15),
        -w * std::sin(0.3) - 0.6 * u * std::sin(-0.5), w * std::cos(0.3) + 0.6 * u * std::cos(-0.5), 0,
        -u / 2 * std::sin(-0.25), 0, 0, u / 2 * std::cos(-0.25);
    return v;
  };
  VectorXd guess = velocity(0.8);
  guess.tail(7).setZero();
  const VectorXd slope = velocity(1) - velocity(0), away = guess - velocity(0);
  const double w = slope.dot(away) / slope.squaredNorm();
  CHECK((a.y.tail(14) - velocity(w)).lpNorm<Eigen::Infinity>() < 2e-15);
}

TEST_CASE("a loop that cannot close names the joints that stay apart and by how much", "[assembly]") {
  Scene scene = four_bar();
  scene.parameters[3].value = 3.0;  // d: 0.4 m more than the three bars together
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  const AssemblyResult& a = assembly.result();
  REQUIRE_FALSE(a.ok);
  CHECK(assembly.tangent().array().isNaN().all());  // never a number that looks like a derivative
  INFO(a.message);
  CHECK(a.message.find("joint 'B' (crank - coupler): points 0.1 m apart") != std::string::npos);
  CHECK(a.message.find("joint 'D' (ground - rocker): points 0.1 m apart") != std::string::npos);
  CHECK(a.message.find("Check the lengths") != std::string::npos);
}

TEST_CASE("a condition out of reach is named with the value that is nearest", "[assembly]") {
  Scene scene = pendulum();
  scene.sensors.push_back(point_sensor("tip", "position", "bar", vec("1", "0", "0"), "y"));
  scene.conditions.push_back(value_of("tip", "1.5"));
  const AssemblyResult a = assemble(scene);
  REQUIRE_FALSE(a.ok);
  INFO(a.message);
  CHECK(a.message.find("condition on 'tip': asks for 1.5 m") != std::string::npos);
  CHECK(a.message.find("joint 'A'") != std::string::npos);
}

TEST_CASE("conditions on velocities that contradict each other are named", "[assembly]") {
  Scene scene = pendulum();
  scene.sensors.push_back(point_sensor("tip_vx", "velocity", "bar", vec("1", "0", "0"), "x"));
  scene.conditions.push_back({"theta", f("theta0"), f("1")});
  scene.conditions.push_back(value_of("tip_vx", "5"));
  const AssemblyResult a = assemble(scene);
  REQUIRE_FALSE(a.ok);
  INFO(a.message);
  CHECK(a.message.find("initial velocities failed") == 0);
  CHECK(a.message.find("condition on 'tip_vx': asks for 5 m/s") != std::string::npos);
  CHECK(a.message.find("condition on 'theta': asks for rate 1 rad/s") != std::string::npos);
}

TEST_CASE("a speed asked of a guess at rest says what is missing", "[assembly]") {
  Scene scene = pendulum();
  scene.sensors.push_back(point_sensor("speed", "velocity", "bar", vec("1", "0", "0"), "norm"));
  scene.conditions.push_back(value_of("speed", "2"));
  const AssemblyResult at_rest = assemble(scene);
  REQUIRE_FALSE(at_rest.ok);
  INFO(at_rest.message);
  CHECK(at_rest.message.find("from a guess at rest") != std::string::npos);
  scene.bodies[0].angular_velocity = vec("0", "0", "-0.3");
  const AssemblyResult moving = assemble(scene);
  REQUIRE(moving.ok);
  CHECK(omega_B(moving.y.segment<4>(3), moving.y.segment<4>(10))(2) == Approx(-2).margin(1e-14));
}

TEST_CASE("a planar loop closes from a guess out of its plane, through the redundant equations", "[assembly]") {
  Scene scene = four_bar();
  scene.bodies[0].orientation = AxisAngleField{vec("0.2", "-0.1", "1"), f("a1")};
  scene.bodies[1].position = vec("0.3", "0.6", "0.15");
  scene.bodies[2].orientation = AxisAngleField{vec("-0.1", "0.3", "1"), f("1.2")};
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  CHECK(assembly.result().residual < 1e-15);
  CHECK(assembly.summary().rank == 20);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(assembly.result().y(7 * i + 2)) < 1e-14);
  check_derivatives(scene);
}

TEST_CASE("an assembly ends after the iterations that the scene allows", "[assembly]") {
  Scene scene;
  scene.bodies = {body("rod", vec("0.5", "0", "0"), vec("0.4", "0.3", "0.1"), turned("0.9"))};
  scene.joints = {hinge("pin", "ground", vec("0", "0", "0"), "rod", vec("0", "0", "0"))};
  CHECK(Assembly(Mechanism(scene, Eigen::VectorXd()), 0).result().ok);
  scene.assembly_iterations = 1;
  CHECK_FALSE(Assembly(Mechanism(scene, Eigen::VectorXd()), 0).result().ok);
}
