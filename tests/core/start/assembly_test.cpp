#include "core/start/assembly.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "core/body/euler_parameters.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kPi = std::numbers::pi;

AssemblyResult assemble(const Scene& scene, const VectorXd& rho) {
  const Mechanism mechanism(scene, rho);
  return Assembly(mechanism, 0).result();
}
AssemblyResult assemble(const Scene& scene) { return assemble(scene, nominal(scene)); }

// Angle about z of a body turned in the plane.
double turn(const AssemblyResult& a, int body) {
  const Vector4d p = a.y.segment<4>(7 * body + 3);
  return 2 * std::atan2(p(3), p(0));
}

Scene spatial_four_bar_of_size(double size) {
  Scene scene = spatial_four_bar();
  const auto scale = [&](VectorField& x) {
    for (Field& c : x) c = f(fmt::format("{}*({})", size, c.text()));
  };
  for (Body& b : scene.bodies) scale(b.com), scale(b.position), scale(b.velocity);
  for (Joint& j : scene.joints) scale(std::get<VectorField>(j.point1)), scale(std::get<VectorField>(j.point2));
  return scene;
}

// Rows of y by central differences, extrapolated once: error O(h^4).
MatrixXd differences(const Scene& scene) {
  const VectorXd rho = nominal(scene);
  MatrixXd D(assemble(scene).y.size(), rho.size());
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    auto slope = [&](double h) {
      VectorXd up = rho, down = rho;
      up(k) += h, down(k) -= h;
      const AssemblyResult a = assemble(scene, up), b = assemble(scene, down);
      INFO(a.message << b.message);
      REQUIRE(a.ok);
      REQUIRE(b.ok);
      return VectorXd((a.y - b.y) / (2 * h));
    };
    D.col(k) = (4 * slope(1e-4) - slope(2e-4)) / 3;
  }
  return D;
}

// The derivatives of the assembled state, two ways, against differences of whole assemblies.
// Rows of positions and velocities are compared in units of size.
void check_derivatives(const Scene& scene, double size = 1) {
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  MatrixXd y_rho = assembly.tangent();
  REQUIRE(y_rho.allFinite());
  MatrixXd D = differences(scene);
  for (Eigen::Index i = 0; i < y_rho.rows(); i += 7) y_rho.middleRows(i, 3) /= size, D.middleRows(i, 3) /= size;
  for (Eigen::Index k = 0; k < D.cols(); ++k) {
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    CHECK((y_rho.col(k) - D.col(k)).lpNorm<Eigen::Infinity>() < 1e-8 * (1 + D.col(k).lpNorm<Eigen::Infinity>()));
  }
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  MatrixXd y_bar = MatrixXd::NullaryExpr(y_rho.rows(), 3, [&] { return normal(random); });
  MatrixXd rho_bar = MatrixXd::Ones(y_rho.cols(), 3);
  MatrixXd y_bar_in_metres = y_bar;
  for (Eigen::Index i = 0; i < y_bar.rows(); i += 7) y_bar_in_metres.middleRows(i, 3) /= size;
  assembly.add_adjoint(y_bar_in_metres, rho_bar);
  rho_bar.array() -= 1;  // it adds
  CHECK((rho_bar - y_rho.transpose() * y_bar).cwiseAbs().maxCoeff() < 1e-13 * (1 + rho_bar.cwiseAbs().maxCoeff()));
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

TEST_CASE("derivatives of the assembled state: planar mechanisms", "[assembly]") {
  SECTION("pendulum at an angle and a rate") {
    Scene scene = pendulum();
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
  SECTION("pendulum at its guess alone") { check_derivatives(pendulum()); }
  SECTION("double pendulum with one angle given: curvature of the constraints matters") {
    Scene scene = double_pendulum();
    scene.conditions.push_back(value_of("theta1", "theta0"));
    check_derivatives(scene);
  }
  SECTION("four-bar from a rough guess") { check_derivatives(four_bar()); }
  SECTION("four-bar at a crank angle, redundant equations") {
    Scene scene = four_bar();
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
}

// Many bodies whose guess satisfies all equations are differentiated by sparse factors; the differences are of dense
// assemblies.
TEST_CASE("derivatives of the assembled state: many bodies that start where they are placed", "[assembly]") {
  SECTION("a chain in space, its first angle and rate given") {
    Scene scene;
    add_parameters(scene, {{"l", 0.2}, {"c", 0.1}, {"rate0", 0.7}, {"w", 0.3}, {"theta0", 0.0}, {"up", 0.0}});
    for (int i = 0; i < 14; ++i) {
      const std::string name = "rod" + std::to_string(i), x = std::to_string(0.2 * i);
      scene.bodies.push_back(body(name, vec("c", "up", "0"), vec(x, "0", "0"), turned("0")));
      scene.bodies.back().angular_velocity = vec("w", "0", "w/2");
      Joint joint = hinge("hinge" + std::to_string(i), i == 0 ? "ground" : "rod" + std::to_string(i - 1),
                          i == 0 ? vec("0", "0", "0") : vec("l", "0", "0"), name, vec("0", "0", "0"));
      if (i % 2 == 1) joint.axis1 = joint.axis2 = vec("0", "1", "0");
      scene.joints.push_back(joint);
    }
    scene.sensors.push_back(angle_sensor("theta", "hinge0"));
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
    check_derivatives(scene);
  }
  SECTION("windows: loops with redundant equations") {
    Scene scene;
    add_parameters(scene, {{"c", 0.5}, {"off", 0.1}, {"w", 0.4}, {"height", 1.0}});
    const auto upright = [](int i) { return "upright" + std::to_string(i); };
    for (int i = 0; i <= 7; ++i) {
      const std::string x = std::to_string(i);
      scene.bodies.push_back(body(upright(i), vec("off", "c", "0"), vec(x, "0", "0"), turned("0")));
      scene.bodies.back().angular_velocity = vec("0", "0", "w");
      scene.joints.push_back(hinge("foot" + x, "ground", vec(x, "0", "0"), upright(i), vec("0", "0", "0")));
      if (i == 0) continue;
      const std::string beam = "beam" + x;
      scene.bodies.push_back(body(beam, vec("0.5", "off", "0"), vec(std::to_string(i - 1), "1", "0"), turned("0")));
      scene.joints.push_back(hinge("left" + x, upright(i - 1), vec("0", "height", "0"), beam, vec("0", "0", "0")));
      scene.joints.push_back(hinge("right" + x, upright(i), vec("0", "height", "0"), beam, vec("1", "0", "0")));
    }
    check_derivatives(scene);
  }
}

TEST_CASE("derivatives of the assembled state: spatial loop, every kind of field and condition", "[assembly]") {
  Scene scene = spatial_four_bar();
  SECTION("no condition") {}
  SECTION("angle and rate") {
    scene.sensors.push_back(angle_sensor("theta", "A"));
    scene.conditions.push_back({"theta", f("x0"), f("v0")});
  }
  SECTION("position of a point, global") {
    scene.sensors.push_back(point_sensor("tip", "position", "coupler", vec("c2", "off", "0.1"), "x"));
    scene.conditions.push_back({"tip", f("x0+0.4"), f("v0")});
  }
  SECTION("position of a point, in the axes of a body that moves, relative to another point") {
    Sensor s = point_sensor("tip", "position", "coupler", vec("c2", "off", "0.1"), "y");
    s.relative_to = PointOnBody{"crank", vec("0", "n", "u")};
    s.in_body_frame = true;
    scene.sensors.push_back(s);
    scene.conditions.push_back({"tip", f("x0-0.4"), f("v0")});
  }
  SECTION("distance and its rate") {
    Sensor s;
    s.name = "gap", s.quantity = "distance", s.body1 = "crank", s.body2 = "rocker";
    s.point1 = vec("n", "0", "0.2"), s.point2 = vec("0", "off", "n");
    scene.sensors.push_back(s);
    scene.conditions.push_back({"gap", f("x0+0.6"), f("v0")});
  }
  SECTION("an expression of positions and its rate") {
    scene.sensors.push_back(angle_sensor("theta", "A"));
    Sensor gap;
    gap.name = "gap", gap.quantity = "distance", gap.body1 = "crank", gap.body2 = "rocker";
    gap.point1 = vec("n", "0", "0.2"), gap.point2 = vec("0", "off", "n");
    scene.sensors.push_back(gap);
    scene.sensors.push_back(expression_sensor("blend", "theta + 0.1*theta*gap + n*gap^2"));
    scene.conditions.push_back({"blend", f("x0"), f("v0")});
  }
  SECTION("an Euler parameter and its rate") {
    Sensor s;
    s.name = "e", s.quantity = "orientation", s.body = "coupler", s.component = "e1";
    scene.sensors.push_back(s);
    scene.conditions.push_back({"e", f("spin/4"), f("v0/5")});
  }
  SECTION("velocity of a point, in the body's axes") {
    Sensor s = point_sensor("v", "velocity", "coupler", vec("c2", "off", "0.1"), "y");
    s.in_body_frame = true;
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("v", "v0"));
  }
  SECTION("angular velocity, two components") {
    for (const char* component : {"x", "z"}) {
      Sensor s;
      s.name = std::string("w") + component, s.quantity = "angular_velocity", s.body = "coupler";
      s.component = component, s.in_body_frame = s.component == "x";
      scene.sensors.push_back(s);
      scene.conditions.push_back(value_of(s.name, s.component == "x" ? "spin" : "v0"));
    }
  }
  SECTION("speeds: norms of velocity and angular velocity, not linear in v") {
    scene.sensors.push_back(point_sensor("speed", "velocity", "crank", vec("c2", "off", "0.1"), "norm"));
    Sensor s;
    s.name = "spin_rate", s.quantity = "angular_velocity", s.body = "coupler", s.component = "norm";
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("speed", "v0"));
    scene.conditions.push_back(value_of("spin_rate", "2*spin"));
  }
  SECTION("distance rate and angle rate as velocities of their own") {
    Sensor s;
    s.name = "closing", s.quantity = "distance_rate", s.body1 = "ground", s.body2 = "coupler";
    s.point1 = vec("n", "0", "0.2"), s.point2 = vec("0", "off", "n");
    scene.sensors.push_back(s);
    scene.conditions.push_back(value_of("closing", "v0"));
  }
  check_derivatives(scene);
}

TEST_CASE("derivatives of a state assembled in micrometres from a rough guess", "[assembly]") {
  constexpr double size = 1e-6;
  Scene scene = spatial_four_bar_of_size(size);
  SECTION("a closed loop") {}
  SECTION("a slide on the coupler, whose equations couple places with turns") {
    scene.bodies.push_back(body("slide", vec("0", "0", "0"), vec("0.7e-6", "0.5e-6", "0.1e-6"), turned("0.4")));
    Joint rail;
    rail.name = "rail", rail.type = "translational", rail.body1 = "coupler", rail.body2 = "slide";
    rail.point1 = vec("0.2e-6", "1e-6*off", "0"), rail.point2 = vec("0.1e-6", "0.3e-6", "-0.2e-6");
    rail.axis1 = vec("1", "w", "0.2"), rail.axis2 = vec("1", "0", "u");
    rail.normal1 = vec("0", "0.2", "-w"), rail.normal2 = vec("0", "1", "0");
    scene.joints.push_back(rail);
  }
  check_derivatives(scene, size);
}

TEST_CASE("a parameter that would break a redundant loop is known to have no derivative", "[assembly]") {
  Scene scene = four_bar();
  add_parameters(scene, {{"tilt", 0.0}});
  scene.joints[3].axis1 = vec("tilt", "0", "1");  // out of the plane's normal: the loop opens
  const Mechanism mechanism(scene, nominal(scene));
  CHECK(Assembly(mechanism, 0).obstructed() == std::vector<int>{7});
  scene.parameters[7].value = 1e-3;
  const AssemblyResult opened = assemble(scene);
  INFO(opened.message);
  CHECK_FALSE(opened.ok);
}

TEST_CASE("only active parameters get derivatives", "[assembly]") {
  const Scene scene = spatial_four_bar();
  const VectorXd rho = nominal(scene);
  std::vector<bool> active(static_cast<std::size_t>(rho.size()), false);
  active[1] = active[9] = true;
  const Mechanism all(scene, rho), some(scene, rho, active);
  const MatrixXd full = Assembly(all, 0).tangent(), part = Assembly(some, 0).tangent();
  REQUIRE(part.cols() == rho.size());
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const bool wanted = active[static_cast<std::size_t>(k)];
    CHECK((part.col(k) - (wanted ? 1.0 : 0.0) * full.col(k)).lpNorm<Eigen::Infinity>() < 1e-13);
  }
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

TEST_CASE("tangent and adjoint of assembly agree from micrometres to ten kilometres", "[assembly]") {
  const double size = GENERATE(1e-6, 1e-3, 1.0, 1e4);
  const bool loose = GENERATE(true, false);
  INFO(size << (loose ? " m, a condition" : " m, a guess"));
  Scene scene = four_bar();
  for (const int length : {0, 1, 2, 3}) scene.parameters[static_cast<std::size_t>(length)].value *= size;
  scene.bodies[1].position = {0.3 * size, 0.6 * size, 0.0};
  scene.bodies[2].position = {1.1 * size, 0.1 * size, 0.0};
  if (loose) {
    scene.conditions.push_back({"theta", f("theta0"), f("rate0")});
  } else {
    scene.bodies[0].angular_velocity = vec("0", "0", "rate0");
  }
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  const MatrixXd y_rho = assembly.tangent();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  MatrixXd y_bar = MatrixXd::NullaryExpr(y_rho.rows(), 3, [&] { return normal(random); });
  for (int i = 0; i < 6; ++i) y_bar.middleRows(7 * i + 3, 4) *= size;  // as the coordinates of points depend on p
  MatrixXd rho_bar = MatrixXd::Zero(y_rho.cols(), 3);
  assembly.add_adjoint(y_bar, rho_bar);
  const MatrixXd expected = y_rho.transpose() * y_bar;
  for (Eigen::Index k = 0; k < expected.size(); ++k) {
    CHECK(rho_bar(k) == Approx(expected(k)).epsilon(1e-10).margin(1e-300));
  }
}

// A slide along e = (cos u, sin u, 0) that turns with u about z. Its velocity is that of the guess along e:
//   r + A s = lambda e,  lambda = e'(r0 + A s),  rdot = e e'rdot0,  pdot = 0
TEST_CASE("a guess that turns fast does not cost the derivatives of a slide their digits, whatever its size",
          "[assembly]") {
  const double size = GENERATE(1e-6, 1e-3, 1.0, 1e4);
  INFO(size << " m");
  const auto sized = [&](double x, double y, double z) {
    return vec(fmt::format("{}", size * x), fmt::format("{}", size * y), fmt::format("{}", size * z));
  };
  constexpr double u = 0.4;
  Scene scene;
  add_parameters(scene, {{"u", u}});
  const Vector3d e(std::cos(u), std::sin(u), 0), across(-std::sin(u), std::cos(u), 0), s(0.3, -0.2, 0.5);
  const Vector3d As = s(0) * e + s(1) * across + Vector3d(0, 0, s(2)), r = 0.3 * e - As, rdot(0.3, -0.5, 0.7);
  Body slide = body("slide", vec("0", "0", "0"), sized(r(0), r(1), r(2)), turned(fmt::format("{}", u)));
  slide.velocity = sized(3e3 * rdot(0), 3e3 * rdot(1), 3e3 * rdot(2));
  slide.angular_velocity = vec("300", "-200", "3000");
  scene.bodies.push_back(slide);
  Joint rail;
  rail.name = "rail", rail.type = "translational", rail.body1 = "ground", rail.body2 = "slide";
  rail.point1 = vec("0", "0", "0"), rail.point2 = sized(s(0), s(1), s(2));
  rail.axis1 = vec("cos(u)", "sin(u)", "0"), rail.axis2 = vec("1", "0", "0");
  rail.normal1 = rail.normal2 = vec("0", "0", "1");
  scene.joints.push_back(rail);
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);

  const Vector3d turned_arm = Vector3d::UnitZ().cross(As), r0 = r;
  const double along = across.dot(r0 + As) + e.dot(turned_arm);
  VectorXd exact = VectorXd::Zero(14);
  exact.head<3>() = size * (along * e + 0.3 * across - turned_arm);
  exact.segment<4>(3) << -0.5 * std::sin(u / 2), 0, 0, 0.5 * std::cos(u / 2);
  exact.segment<3>(7) = 3e3 * size * (across * e.dot(rdot) + e * across.dot(rdot));
  VectorXd units(14);
  units << VectorXd::Constant(3, size), VectorXd::Ones(4), VectorXd::Constant(3, 3e3 * size),
      VectorXd::Constant(4, 3e3);
  const MatrixXd y_rho = assembly.tangent();
  CHECK((y_rho.col(0) - exact).cwiseQuotient(units).lpNorm<Eigen::Infinity>() < 1e-12);
  const MatrixXd y_bar = units.cwiseInverse().asDiagonal() * MatrixXd::Identity(14, 14);
  MatrixXd rho_bar = MatrixXd::Zero(1, 14);
  assembly.add_adjoint(y_bar, rho_bar);
  CHECK((rho_bar.transpose() - exact.cwiseQuotient(units)).lpNorm<Eigen::Infinity>() < 1e-12);
}

// A point s from the centre of mass is asked onto a plane: Delta r = -nu n, Delta p = -nu B(p, s)'n at the least
// |Delta r|^2 + |Delta p|^2, however short s is.
TEST_CASE("a short arm turns its body as the nearest state asks, whatever the size of the mechanism", "[assembly]") {
  const double size = GENERATE(1e-6, 1.0, 1e4), arm = GENERATE(1e-9, 1e-7) * size;
  INFO(arm << " m of " << size << " m");
  const auto sized = [&](double x, double y, double z) {
    return vec(fmt::format("{}", size * x), fmt::format("{}", size * y), fmt::format("{}", size * z));
  };
  Scene scene;
  scene.bodies.push_back(body("rod", vec("0", "0", "0"), sized(0.3, 0.4, 0.5), turned("0")));
  scene.bodies.push_back(body("plate", vec("0", "0", "0"), sized(0.2, 0.1, 0), turned("0")));
  Joint on_plane;
  on_plane.name = "on_plane", on_plane.type = "point_on_plane", on_plane.body1 = "ground", on_plane.body2 = "rod";
  on_plane.point1 = sized(0, 0, 0.5), on_plane.axis1 = vec("0", "0", "1");
  on_plane.point2 = vec(fmt::format("{}", 0.6 * arm), "0", fmt::format("{}", 0.8 * arm));
  scene.joints.push_back(on_plane);
  Joint pin;  // a long arm
  pin.name = "pin", pin.type = "spherical", pin.body1 = "ground", pin.body2 = "plate";
  pin.point1 = sized(0, 0, 0), pin.point2 = sized(-0.2, -0.1, 0);
  scene.joints.push_back(pin);
  const AssemblyResult a = assemble(scene);
  INFO(a.message);
  REQUIRE(a.ok);
  // r_z + s_z (1 - 2 e1^2 - 2 e2^2) + 2 s_x (e1 e3 - e0 e2) = 0.5 size, to first order in e2: e2 = 2 s_x nu
  const double nu = 0.8 * arm / (1 + 4 * 0.36 * arm * arm);
  CHECK(a.y(2) - 0.5 * size == Approx(-nu).epsilon(1e-3).margin(4e-16 * size));
  CHECK(a.y(5) == Approx(2 * 0.6 * arm * nu).epsilon(1e-3).margin(1e-15));
}

TEST_CASE("assembly gives a mechanism of micrometres the motion of one of metres", "[assembly]") {
  const auto assembled = [](double size) {
    Scene scene = spatial_four_bar_of_size(size);
    Drive drive;
    drive.name = "motor", drive.type = "angle", drive.joint = "A", drive.law = f("0.9 + 2*t");
    scene.drives.push_back(drive);
    // The coupler turns about its own axis as the guess says: held, so that no metric decides.
    Sensor roll;
    roll.name = "roll_rate", roll.quantity = "angular_velocity", roll.body = "coupler", roll.component = "x";
    roll.in_body_frame = true;
    scene.sensors.push_back(roll);
    scene.conditions.push_back(value_of("roll_rate", "0.3"));
    Sensor e;
    e.name = "e", e.quantity = "orientation", e.body = "coupler", e.component = "e1";
    scene.sensors.push_back(e);
    scene.conditions.push_back(value_of("e", "0.12"));
    const AssemblyResult a = assemble(scene);
    INFO(a.message);
    REQUIRE(a.ok);
    VectorXd y = a.y;
    for (Eigen::Index k = 0; k < y.size(); k += 7) y.segment<3>(k) /= size;
    return y;
  };
  const VectorXd metres = assembled(1);
  for (const double size : {1e-6, 1e4}) {
    INFO(size);
    CHECK((assembled(size) - metres).lpNorm<Eigen::Infinity>() < 1e-9);
  }
}

TEST_CASE("the order of bodies and joints does not change a state assembled from a rough guess, whatever its size",
          "[assembly]") {
  const double size = GENERATE(1e-6, 1.0, 1e4);
  INFO(size << " m");
  Scene scene = spatial_four_bar_of_size(size);
  // Free to move as a whole: only metres say where to, only Euler parameters how far it turns.
  scene.bodies.push_back(
      body("frame", vec("0", "0", "0"), vec("0", "0", "0"), AxisAngleField{vec("1", "2", "3"), f("0.01")}));
  scene.bodies.back().angular_velocity = vec("0.3", "0.2", "0.1");
  for (Joint& j : scene.joints) {
    if (j.body1 == "ground") j.body1 = "frame";
  }
  Scene reversed = scene;
  std::reverse(reversed.bodies.begin(), reversed.bodies.end());
  std::reverse(reversed.joints.begin(), reversed.joints.end());
  const AssemblyResult a = assemble(scene), b = assemble(reversed);
  INFO(a.message << b.message);
  REQUIRE(a.ok);
  REQUIRE(b.ok);
  const Eigen::Index bodies = a.y.size() / 14;
  double translations = 0, turns = 0;
  for (Eigen::Index k = 0; k < 2 * bodies; ++k) {
    const Eigen::Index other = 7 * (k < bodies ? bodies - 1 - k : 3 * bodies - 1 - k);
    const VectorXd difference = a.y.segment<7>(7 * k) - b.y.segment<7>(other);
    translations = std::max(translations, difference.head<3>().lpNorm<Eigen::Infinity>() / size);
    turns = std::max(turns, difference.tail<4>().lpNorm<Eigen::Infinity>());
  }
  CHECK(translations < 1e-12);
  CHECK(turns < 1e-12);
}

TEST_CASE("an assembly ends after the iterations that the scene allows", "[assembly]") {
  Scene scene;
  scene.bodies = {body("rod", vec("0.5", "0", "0"), vec("0.4", "0.3", "0.1"), turned("0.9"))};
  scene.joints = {hinge("pin", "ground", vec("0", "0", "0"), "rod", vec("0", "0", "0"))};
  CHECK(Assembly(Mechanism(scene, Eigen::VectorXd()), 0).result().ok);
  scene.assembly_iterations = 1;
  CHECK_FALSE(Assembly(Mechanism(scene, Eigen::VectorXd()), 0).result().ok);
}
