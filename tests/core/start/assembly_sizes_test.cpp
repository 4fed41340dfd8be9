// Assemblies from micrometres to kilometres (core/start/assembly.hpp).
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "tests/core/start/assembled.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Scene spatial_four_bar_of_size(double size) {
  Scene scene = spatial_four_bar();
  const auto scale = [&](VectorField& x) {
    for (Field& c : x) c = f(fmt::format("{}*({})", size, c.text()));
  };
  for (Body& b : scene.bodies) scale(b.com), scale(b.position), scale(b.velocity);
  for (Joint& j : scene.joints) scale(std::get<VectorField>(j.point1)), scale(std::get<VectorField>(j.point2));
  return scene;
}

}  // namespace

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

// Rounding of the free body's null space in the arm's coordinates, times the arm's second derivatives, which are 1e12
// times those in metres, moved the stone by 6e-11 m and 2e-7 m/s per unit of u.
TEST_CASE("a parameter of an arm of micrometres moves no body that is not joined to it", "[assembly]") {
  Scene scene;
  add_parameters(scene, {{"u", 0.8}});
  scene.bodies.push_back(body("stone", vec("0", "0", "0"), vec("0.7e-6", "0.5e-6", "0.1e-6"), turned("0.4")));
  scene.bodies.push_back(body("arm", vec("0", "0", "0"), vec("0.4e-6", "0.4e-6", "0.5e-6"), turned("0.3")));
  Joint pin = hinge("pin", "ground", vec("0.3e-6", "-0.1e-6", "0.3e-6"), "arm", vec("0.4e-6", "0.2e-6", "-0.2e-6"));
  pin.axis1 = vec("-0.1", "u", "-0.6"), pin.axis2 = vec("0", "-0.9", "0.3");
  pin.normal1 = vec("1", "0.125", "0"), pin.normal2 = vec("1", "0", "0");
  scene.joints.push_back(pin);
  Drive motor;
  motor.name = "motor", motor.type = "distance", motor.body2 = "arm", motor.law = f("1.9e-6 + 1e-3*t");
  motor.point1 = vec("1.4e-6", "0.7e-6", "2.1e-6"), motor.point2 = vec("0", "0", "0");
  scene.drives.push_back(motor);
  const Mechanism mechanism(scene, nominal(scene));
  const Assembly assembly(mechanism, 0);
  INFO(assembly.result().message);
  REQUIRE(assembly.result().ok);
  const MatrixXd y_rho = assembly.tangent();
  CHECK(y_rho.middleRows(7, 7).cwiseAbs().maxCoeff() > 0.2);
  for (const Eigen::Index of_stone : {0, 14}) CHECK(y_rho.middleRows(of_stone, 7).isZero(0));
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
