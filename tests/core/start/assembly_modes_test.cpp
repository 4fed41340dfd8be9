// The assembly modes of a four-bar, of a two-loop and of a spatial linkage are known; scenes moved to them assemble
// there.
#include "core/start/assembly_modes.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "core/body/euler_parameters.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

Drive crank_drive(const std::string& law) {
  Drive drive;
  drive.name = "motor", drive.type = "angle", drive.joint = "A", drive.law = f(law);
  return drive;
}

// Crank r at angle a, coupler l, rocker b, pivots at the origin and at (g, 0).
Scene linkage() {
  Scene s;
  add_parameters(s, {{"r", 0.4}, {"l", 1.5}, {"b", 1.2}, {"g", 1.6}, {"a", 0.7}});
  const InertiaField I{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1, I, vec("0", "0", "0")));
  s.bodies.push_back(plain_body("coupler", 1, I, vec("r*cos(a)", "r*sin(a)", "0")));
  s.bodies.push_back(plain_body("rocker", 1, I, vec("g", "0", "0")));
  s.bodies[0].orientation = turned("a"), s.bodies[1].orientation = turned("0.5"), s.bodies[2].orientation = turned("2");
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", vec("r", "0", "0"), "coupler", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "coupler", vec("l", "0", "0"), "rocker", vec("b", "0", "0")));
  s.joints.push_back(hinge("D", "ground", vec("g", "0", "0"), "rocker", vec("0", "0", "0")));
  s.drives.push_back(crank_drive("a"));
  return s;
}

// A second loop of two bars on the rocker's end: the two loops close in two ways each.
Scene two_loops() {
  Scene s = linkage();
  const InertiaField I{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("link", 1, I, vec("1.6", "1.2", "0")));
  s.bodies.push_back(plain_body("output", 1, I, vec("2.5", "0", "0")));
  s.bodies[4].orientation = turned("1.5");
  s.joints.push_back(hinge("E", "rocker", vec("b", "0", "0"), "link", vec("0", "0", "0")));
  s.joints.push_back(hinge("F", "link", vec("1.8", "0", "0"), "output", vec("1.6", "0", "0")));
  s.joints.push_back(hinge("G", "ground", vec("2.5", "0", "0"), "output", vec("0", "0", "0")));
  return s;
}

// The crank alone, about an axis of any direction.
Scene crank_about(const VectorField& axis) {
  Scene s;
  add_parameters(s, {{"a", 0.7}, {"f", 0.4}});
  const InertiaField I{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1, I, vec("0", "0", "0")));
  s.bodies[0].orientation = AxisAngleField{axis, f("a")};
  Joint pin = hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0"));
  pin.axis1 = axis, pin.axis2 = axis, pin.normal1 = vec("1", "0", "0"), pin.normal2 = vec("1", "0", "0");
  s.joints.push_back(pin);
  s.drives.push_back(crank_drive("a"));
  return s;
}

// An arm with its orientation in the file welded to a body.
void add_arm(Scene& s, const std::string& on, const VectorField& position, const OrientationField& orientation) {
  const InertiaField I{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("arm", 1, I, position));
  s.bodies.back().orientation = orientation;
  Joint weld;
  weld.name = "weld", weld.type = "fixed", weld.body1 = on, weld.body2 = "arm";
  weld.point1 = vec("0", "0", "0"), weld.point2 = vec("0", "0", "0");
  s.joints.push_back(weld);
}

// A crank about z, a coupler with a ball at the crank and a universal joint at the rocker, a rocker about x: its pin is
// on a circle and on a sphere about the crank's, and the coupler stands either way round about its length.
Scene spatial_linkage() {
  Scene s;
  add_parameters(s, {{"r", 0.3}, {"l", 1.4}, {"b", 0.9}, {"a", 0.7}});
  const InertiaField I{0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1, I, vec("0", "0", "0")));
  s.bodies.push_back(plain_body("coupler", 1, I, vec("r*cos(a)", "r*sin(a)", "0")));
  s.bodies.push_back(plain_body("rocker", 1, I, vec("1", "0.9", "0")));
  s.bodies[0].orientation = turned("a");
  s.bodies[1].orientation = RollPitchYawField{vec("0.3", "-0.7", "0.7")};
  s.bodies[2].orientation = AxisAngleField{vec("1", "0", "0"), f("0.2")};
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(ball("B", "crank", vec("r", "0", "0"), "coupler", vec("0", "0", "0")));
  Joint cross = ball("C", "coupler", vec("l", "0", "0"), "rocker", vec("0", "0", "b"));
  cross.type = "universal", cross.axis1 = vec("0", "1", "0"), cross.axis2 = vec("1", "0", "0");
  s.joints.push_back(cross);
  Joint pivot = hinge("D", "ground", vec("1", "0.9", "0"), "rocker", vec("0", "0", "0"));
  pivot.axis1 = vec("1", "0", "0"), pivot.axis2 = vec("1", "0", "0");
  s.joints.push_back(pivot);
  s.drives.push_back(crank_drive("a"));
  return s;
}

}  // namespace

TEST_CASE("a four-bar has two assembly modes, mirror images about the line from pin to pivot", "[modes]") {
  const Scene scene = linkage();
  const VectorXd rho = nominal(scene);
  const std::vector<AssemblyMode> modes = assembly_modes(Mechanism(scene, rho), 0);
  REQUIRE(modes.size() == 2);
  CHECK(modes[0].distance == 0);
  CHECK((modes[0].q - Assembly(Mechanism(scene, rho), 0).result().y.head(21)).norm() < 1e-12);
  const double line = std::atan2(-rho(0) * std::sin(rho(4)), rho(3) - rho(0) * std::cos(rho(4)));
  const auto angle = [](const VectorXd& q) { return 2 * std::atan2(q(13), q(10)); };  // of the coupler
  const double sum = angle(modes[0].q) + angle(modes[1].q) - 2 * line;
  CHECK(std::abs(std::remainder(sum, 2 * 3.141592653589793)) < 1e-9);
}

// det Phi_q of a four-bar has the sign of sin(coupler - rocker).
TEST_CASE("a four-bar assembles on the side of its guess, also from far", "[modes]") {
  Scene scene = linkage();
  const VectorXd rho = nominal(scene);
  for (const AssemblyMode& mode : assembly_modes(Mechanism(scene, rho), 0)) {
    const double coupler = 2 * std::atan2(mode.q(13), mode.q(10)), rocker = 2 * std::atan2(mode.q(20), mode.q(17));
    const double offset = GENERATE(-0.8, -0.4, 0.4, 0.8), other = GENERATE(-0.8, -0.3, 0.3, 0.8);
    if (std::sin(coupler + offset - rocker - other) * std::sin(coupler - rocker) < 0.1) continue;
    scene.bodies[1].orientation = turned(std::to_string(coupler + offset));
    scene.bodies[2].orientation = turned(std::to_string(rocker + other));
    const Assembly found(Mechanism(scene, rho), 0);
    REQUIRE(found.result().ok);
    CHECK((found.result().y.head(mode.q.size()) - mode.q).norm() < 1e-9);
  }
}

TEST_CASE("two loops have four assembly modes", "[modes]") {
  const Scene scene = two_loops();
  CHECK(assembly_modes(Mechanism(scene, nominal(scene)), 0).size() == 4);
}

TEST_CASE("a scene moved to a mode assembles to it, at other parameters, too", "[modes]") {
  const Scene scene = two_loops();
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const std::vector<AssemblyMode> modes = assembly_modes(mechanism, 0);
  for (const AssemblyMode& mode : modes) {
    Scene moved = scene;
    set_guess(moved, mechanism, mode);
    const Assembly there(Mechanism(moved, rho), 0);
    REQUIRE(there.result().ok);
    CHECK((there.result().y.head(mode.q.size()) - mode.q).norm() < 1e-9);
    VectorXd other = rho;
    other(4) += 0.3;  // the crank's guess turns with its parameter
    const Assembly later(Mechanism(moved, other), 0);
    REQUIRE(later.result().ok);
    CHECK((later.result().y.head(mode.q.size()) - mode.q).norm() < 0.5);
  }
}

TEST_CASE("what is free has no assembly modes", "[modes]") {
  Scene scene = linkage();
  scene.drives.clear();
  CHECK(assembly_modes(Mechanism(scene, nominal(scene)), 0).empty());
}

TEST_CASE("a joint inside out is no mode: a crank has one, with a welded arm, too", "[modes]") {
  const auto count = [](const Scene& scene) { return assembly_modes(Mechanism(scene, nominal(scene)), 0).size(); };
  Scene scene = crank_about(vec("0", "0", "1"));
  CHECK(count(scene) == 1);
  add_arm(scene, "crank", vec("0", "0", "0"), turned("a + f"));
  CHECK(count(scene) == 1);
  CHECK(count(crank_about(vec("0", "0.1", "1"))) == 1);
}

TEST_CASE("a spatial linkage has four assembly modes", "[modes]") {
  const Scene scene = spatial_linkage();
  const Mechanism mechanism(scene, nominal(scene));
  const std::vector<AssemblyMode> modes = assembly_modes(mechanism, 0);
  REQUIRE(modes.size() == 4);
  for (const AssemblyMode& mode : modes) {
    Scene moved = scene;
    set_guess(moved, mechanism, mode);
    const Assembly there(Mechanism(moved, nominal(scene)), 0);
    REQUIRE(there.result().ok);
    CHECK((there.result().y.head(mode.q.size()) - mode.q).norm() < 1e-9);
  }
}

TEST_CASE("what a joint takes from the poses is the same function of the parameters in every mode", "[modes]") {
  Scene scene = linkage();
  add_parameters(scene, {{"f", 0.4}});
  const OrientationField orientation =
      GENERATE(OrientationField(RollPitchYawField{vec("0.2*f", "-f", "0.5 + f")}),
               OrientationField(EulerParametersField{{f("1"), f("0.2"), f("f"), f("0.3 + f")}}),
               OrientationField(AxisAngleField{vec("f", "0.2", "1"), f("0.5 + f")}), turned("0.5 + f"));
  add_arm(scene, "coupler", vec("r*cos(a)", "r*sin(a)", "0"), orientation);
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const std::vector<AssemblyMode> modes = assembly_modes(mechanism, 0);
  REQUIRE(modes.size() == 2);
  VectorXd other = rho;
  other(5) += 0.2;
  const auto weld = [&](const Scene& of) -> Matrix3d {
    const Assembly assembled(Mechanism(of, other), 0);
    REQUIRE(assembled.result().ok);
    const VectorXd& y = assembled.result().y;
    return A(Vector4d(y.segment<4>(10))).transpose() * A(Vector4d(y.segment<4>(24)));
  };
  Scene moved = scene;
  set_guess(moved, mechanism, modes[1]);
  CHECK((weld(moved) - weld(scene)).norm() < 1e-9);
}

TEST_CASE("the search for assembly modes stops on request", "[modes]") {
  const Scene scene = two_loops();
  CHECK(assembly_modes(Mechanism(scene, nominal(scene)), 0, [] { return false; }).size() == 1);
}
