// Frequencies and damping ratios of modes: closed forms, differences, and the tangent-linear derivative.
#include "optim/objective/followed_mode.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kMass = 2, kInertia = 0.3, kGravity = 9.81;

// A pendulum that hangs on a hinge with the torque -k angle - c rate: rho = (k, c, l).
Scene hanging_pendulum() {
  Scene s;
  s.gravity = {0.0, -kGravity, 0.0};
  add_parameters(s, {{"k", 5.0}, {"c", 1.2}, {"l", 0.7}});
  s.bodies.push_back(plain_body("bob", kMass, {kInertia, kInertia, kInertia, 0.0, 0.0, 0.0}, vec("0", "-l", "0")));
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "bob", vec("0", "l", "0")));
  s.joints[0].normal1 = vec("1", "0", "0"), s.joints[0].normal2 = vec("1", "0", "0");
  Rsda torsion;
  torsion.joint = "pin", torsion.stiffness = f("k"), torsion.damping = f("c");
  s.forces.push_back({"torsion", torsion});
  return s;
}

VectorXd gradient(const FollowedMode& mode, const VectorXd& rho) { return mode.slopes(rho, {}).front().gradient; }

}  // namespace

TEST_CASE("frequency and damping of a pendulum have the derivatives of their closed forms", "[followed_mode]") {
  const Scene scene = hanging_pendulum();
  const VectorXd rho = nominal(scene);
  const double k = rho(0), c = rho(1), l = rho(2);
  // |lambda| = sqrt(K/I), zeta = c/(2 sqrt(K I)),  K = k + m g l,  I = I_g + m l^2
  const double K = k + kMass * kGravity * l, I = kInertia + kMass * l * l, I_l = 2 * kMass * l, K_l = kMass * kGravity;
  const double omega = std::sqrt(K / I), zeta = c / (2 * std::sqrt(K * I)), turn = 2 * std::numbers::pi;

  const FollowedMode frequency(scene, {1, "frequency"}), damping(scene, {1, "damping"});
  CHECK(frequency.value(rho, {}) == Approx(omega / turn).epsilon(1e-12));
  CHECK(damping.value(rho, {}) == Approx(zeta).epsilon(1e-12));
  const VectorXd f = gradient(frequency, rho), d = gradient(damping, rho);
  CHECK(f(0) == Approx(omega / (2 * K) / turn).epsilon(1e-9));
  CHECK(f(1) == Approx(0).margin(1e-10));
  CHECK(f(2) == Approx(omega / 2 * (K_l / K - I_l / I) / turn).epsilon(1e-9));
  CHECK(d(0) == Approx(-zeta / (2 * K)).epsilon(1e-9));
  CHECK(d(1) == Approx(zeta / c).epsilon(1e-9));
  CHECK(d(2) == Approx(-zeta / 2 * (K_l / K + I_l / I)).epsilon(1e-9));
}

TEST_CASE("an eigenvalue objective fails in words without an equilibrium and without such a mode", "[followed_mode]") {
  Scene scene = hanging_pendulum();
  CHECK_THROWS_WITH(FollowedMode(scene, {2, "frequency"}).value(nominal(scene), {}),
                    Catch::Contains("there is no mode 2: the initial state has 1"));
  scene.bodies[0].angular_velocity = {0.0, 0.0, 1.0}, scene.bodies[0].velocity = vec("l", "0", "0");
  CHECK_THROWS_WITH(FollowedMode(scene, {1, "frequency"}).value(nominal(scene), {}), Catch::Contains("no equilibrium"));
}

// Along rho the modes of a double pendulum pass from its bobs against each other to both as one: at each rho, one of
// the two objectives has the product of frequencies that det K/det M gives for the other.
TEST_CASE("objectives of two modes never follow the same one", "[followed_mode]") {
  Scene scene = hanging_pendulum();
  add_parameters(scene, {{"k2", 0.01}});
  scene.bodies.push_back(
      plain_body("bob2", kMass, {kInertia, kInertia, kInertia, 0.0, 0.0, 0.0}, vec("0", "-3*l", "0")));
  scene.joints.push_back(hinge("elbow", "bob", vec("0", "-l", "0"), "bob2", vec("0", "l", "0")));
  scene.joints[1].normal1 = vec("1", "0", "0"), scene.joints[1].normal2 = vec("1", "0", "0");
  Rsda torsion;
  torsion.joint = "elbow", torsion.stiffness = f("k2");
  scene.forces.push_back({"torsion2", torsion});
  const FollowedMode first(scene, {1, "frequency"}), second(scene, {2, "frequency"}),
      least(scene, {{}, "least_frequency"});
  VectorXd rho = nominal(scene);
  rho(1) = 0;
  for (const double k2 : {0.01, 1.0, 30.0, 300.0, 1e4}) {
    for (const double k : {0.0, 5.0, 500.0, 5e4}) {
      rho(0) = k, rho(3) = k2;
      const double l = rho(2), w = kMass * kGravity * l, J = kInertia + kMass * l * l, both = 4 * kMass * l * l;
      // angles of both bobs to the vertical: M = [J + both, both/2; both/2, J],  K = [k + k2 + 3 w, -k2; -k2, k2 + w]
      const double det_M = (J + both) * J - both * both / 4, det_K = (k + k2 + 3 * w) * (k2 + w) - k2 * k2;
      const double turns = std::pow(2 * std::numbers::pi, 2);
      CAPTURE(k, k2);
      const double f1 = first.value(rho, {}), f2 = second.value(rho, {});
      CHECK(f1 * f2 * turns == Approx(std::sqrt(det_K / det_M)).epsilon(1e-6));
      CHECK(least.value(rho, {}) == std::min(f1, f2));
      const std::vector<FollowedMode::Slope> slopes = least.slopes(rho, {});
      REQUIRE(slopes.size() == 2);
      CHECK(slopes[1].value == Approx(std::max(f1, f2)).epsilon(1e-12));
      CHECK((slopes[0].gradient - gradient(f1 < f2 ? first : second, rho)).norm() == 0);
    }
  }
}
