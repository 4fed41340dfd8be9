// A dyad that cannot reach its pivot opens all three of its joints alike: each by a third of the gap.
#include "core/start/nearest_approach.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/mechanism/mechanism_data.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

Scene dyad(VectorField pivot) {
  Scene s;
  add_parameters(s, {{"a", 0.4}, {"b", 0.5}, {"D", 1.2}, {"turn", 0.5}});
  const InertiaField inertia{0.01, 0.01, 0.01, 0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("crank", 1, inertia, vec("0", "0", "0")));
  s.bodies.push_back(plain_body("rod", 1, inertia, vec("a", "0", "0")));
  s.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "crank", vec("0", "0", "0")));
  s.joints.push_back(hinge("B", "crank", vec("a", "0", "0"), "rod", vec("0", "0", "0")));
  s.joints.push_back(hinge("C", "ground", std::move(pivot), "rod", vec("b", "0", "0")));
  return s;
}

}  // namespace

// With the crank at theta the gap is g = |D u - a e(theta)| - b. |Phi|^2 = g^2/3 + (theta - turn)^2 is least where
// g g_theta/3 + theta - turn = 0, and theta is stationary in its derivatives.
TEST_CASE("a driven dyad in the plane that is too short: defect and gradient in closed form", "[nearest_approach]") {
  Scene s = dyad(vec("D*cos(0.3)", "D*sin(0.3)", "0"));
  Drive motor;
  motor.name = "motor", motor.type = "angle", motor.joint = "A", motor.law = f("turn");
  s.drives.push_back(motor);
  const Mechanism mechanism(s, nominal(s));
  REQUIRE(mechanism.data().planar);
  const double a = 0.4, b = 0.5, D = 1.2, turn = 0.5;
  const Vector2d u(std::cos(0.3), std::sin(0.3));
  Vector2d e, w;
  double g = 0;
  const auto slope = [&](double theta) {
    e = {std::cos(theta), std::sin(theta)};
    const Vector2d reach = D * u - a * e;
    w = reach.normalized(), g = reach.norm() - b;
    return g * -a * Vector2d(-e.y(), e.x()).dot(w) / 3 + theta - turn;
  };
  double below = 0.3, above = turn;
  for (int k = 0; k < 60; ++k) {
    const double theta = (below + above) / 2;
    (slope(theta) < 0 ? below : above) = theta;
  }
  slope(above);
  const double Phi = std::hypot(g / std::sqrt(3.0), above - turn), root = std::sqrt(mechanism.data().m);

  VectorXd e_rho;
  NearestApproach approach(mechanism, 0);
  CHECK(approach.defect(0, e_rho) == Approx(Phi / root).epsilon(1e-12));
  // The search ends where |Phi| falls by 1e-12 of itself, so that q is off by some 1e-6.
  constexpr double kStationary = 1e-5;
  const double per_gap = g / (3 * Phi * root);
  CHECK(e_rho(0) == Approx(-per_gap * e.dot(w)).epsilon(kStationary));
  CHECK(e_rho(1) == Approx(-per_gap).epsilon(kStationary));
  CHECK(e_rho(2) == Approx(per_gap * u.dot(w)).epsilon(kStationary));
  CHECK(e_rho(3) == Approx((turn - above) / (Phi * root)).epsilon(kStationary));
}

TEST_CASE("a dyad in space that is too short lies along the line to its pivot", "[nearest_approach]") {
  Scene s = dyad(vec("D*2/7", "D*3/7", "D*6/7"));
  for (Joint& joint : s.joints) joint.type = "spherical";
  const Mechanism mechanism(s, nominal(s));
  REQUIRE_FALSE(mechanism.data().planar);
  const double root = std::sqrt(3.0 * mechanism.data().m);
  VectorXd e_rho;
  NearestApproach approach(mechanism, 0);
  CHECK(approach.defect(0, e_rho) == Approx((1.2 - 0.4 - 0.5) / root).epsilon(1e-12));
  CHECK(e_rho(0) == Approx(-1 / root).epsilon(1e-9));
  CHECK(e_rho(1) == Approx(-1 / root).epsilon(1e-9));
  CHECK(e_rho(2) == Approx(1 / root).epsilon(1e-9));
  CHECK(e_rho(3) == 0);
}
