// Eigenvalues and transfer functions against closed forms, modes against differences of the equations of motion.
#include "core/start/linearisation.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "core/body/state_layout.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kLength = 0.7, kMass = 2, kInertia = 0.3, kGravity = 9.81, kSpring = 5, kDamper = 1.2;

// A pendulum that hangs on a hinge with the torque u - k angle - c rate.
Scene hanging_pendulum() {
  Scene s;
  s.gravity = {0.0, -kGravity, 0.0};
  add_parameters(s, {{"u", 0.0}, {"k", kSpring}, {"c", kDamper}, {"l", kLength}});
  s.bodies.push_back(plain_body("bob", kMass, {kInertia, kInertia, kInertia, 0.0, 0.0, 0.0}, {0.0, -kLength, 0.0}));
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "bob", vec("0", "l", "0")));
  s.joints[0].normal1 = vec("1", "0", "0"), s.joints[0].normal2 = vec("1", "0", "0");
  Rsda torsion;
  torsion.joint = "pin", torsion.law = f("k*angle + c*rate - u");
  s.forces.push_back({"torsion", torsion});
  s.sensors.push_back(angle_sensor("angle", "pin"));
  s.sensors.push_back(point_sensor("ax", "acceleration", "bob", vec("0", "0", "0"), "x"));
  return s;
}

struct Linearised {
  Mechanism mechanism;
  Assembly assembly;
  Linearisation x;
  explicit Linearised(const Scene& scene, const std::vector<int>& inputs = {}, const std::vector<int>& outputs = {})
      : mechanism(scene, nominal(scene)),
        assembly(mechanism, 0),
        x(linearise(mechanism, scene.simulation.formulation, {0, assembly.result().y, assembly.result().angles}, inputs,
                    outputs)) {}
};

}  // namespace

TEST_CASE("a pendulum with spring and damper has the eigenvalues and the transfer function of its equation",
          "[linearisation]") {
  const Linearised pendulum(hanging_pendulum(), {0}, {0, 1});
  const Linearisation& x = pendulum.x;
  // I theta'' + c theta' + (k + m g l) theta = u
  const double I = kInertia + kMass * kLength * kLength, K = kSpring + kMass * kGravity * kLength;
  REQUIRE(x.eigenvalues.size() == 2);
  const double re = -kDamper / (2 * I), im = std::sqrt(K / I - re * re);
  CHECK(x.eigenvalues(0).real() == Approx(re).epsilon(1e-12));
  CHECK(x.eigenvalues(0).imag() == Approx(im).epsilon(1e-12));
  CHECK(x.eigenvalues(1).imag() == Approx(-im).epsilon(1e-12));
  CHECK(frequency(x.eigenvalues(0)) == Approx(std::sqrt(K / I) / (2 * std::numbers::pi)).epsilon(1e-12));
  CHECK(damping_ratio(x.eigenvalues(0)) == Approx(kDamper / (2 * std::sqrt(K * I))).epsilon(1e-12));
  CHECK(is_equilibrium(x));

  const std::complex<double> s(0.4, 1.3);
  const Eigen::MatrixXcd resolvent = (s * Eigen::MatrixXcd::Identity(2, 2) - x.A).inverse();
  const Eigen::VectorXcd H = x.C * resolvent * x.B + x.D;
  const std::complex<double> theta = 1.0 / (I * s * s + kDamper * s + K), acceleration = kLength * s * s * theta;
  CHECK(std::abs(H(0) - theta) < 1e-12 * std::abs(theta));
  CHECK(std::abs(H(1) - acceleration) < 1e-12 * std::abs(acceleration));
}

TEST_CASE("a body that circles without forces has no stiffness along its path", "[linearisation]") {
  Scene scene = point_pendulum();
  scene.gravity = {0.0, 0.0, 0.0};
  scene.bodies[0].velocity = {0.0, -3.0, 0.0}, scene.bodies[0].angular_velocity = {0.0, 0.0, 3.0};
  const Linearisation x = Linearised(scene).x;
  CHECK(x.A.bottomRows(1).norm() < 1e-12);
  CHECK(x.largest_rate == Approx(3));
  CHECK_FALSE(is_equilibrium(x));
  for (int k = 0; k < 2; ++k) CHECK(std::abs(x.eigenvalues(k)) <= 1e-6);
}

TEST_CASE("modes of a spatial chain satisfy the equations of motion, and redundant joints change nothing",
          "[linearisation]") {
  Scene scene;
  scene.gravity = {0.0, 0.0, -9.81};
  const InertiaField inertia{0.02, 0.03, 0.01, 0.002, 0.0, 0.0};
  scene.bodies.push_back(plain_body("a", 1.5, inertia, {0.0, 0.0, -0.4}));
  scene.bodies.push_back(plain_body("b", 0.8, inertia, {0.0, 0.0, -1.1}));
  scene.joints.push_back(ball("top", "ground", vec("0", "0", "0"), "a", vec("0", "0", "0.4")));
  scene.joints.push_back(ball("middle", "a", vec("0", "0", "-0.4"), "b", vec("0", "0", "0.3")));
  Linearised chain(scene);
  const Linearisation& x = chain.x;
  REQUIRE(x.eigenvalues.size() == 12);
  SpatialDynamics dynamics(chain.mechanism, scene.simulation.formulation);
  const VectorXd &y = chain.assembly.result().y, &angles = chain.assembly.result().angles;
  const Eigen::Index half = y.size() / 2;
  VectorXd plus(y.size()), minus(y.size());
  int oscillating = 0;
  for (Eigen::Index k = 0; k < x.eigenvalues.size(); ++k) {
    if (std::abs(x.eigenvalues(k)) < 1e-3) continue;  // turns about the vertical
    ++oscillating;
    const double h = 1e-4;
    const VectorXd m = x.modes.col(k).real();
    REQUIRE(dynamics.evaluate(0, y + h * m, angles, plus));
    REQUIRE(dynamics.evaluate(0, y - h * m, angles, minus));
    const VectorXd expected = (x.eigenvalues(k) * x.modes.col(k)).real();
    const VectorXd found = (plus - minus) / (2 * h);
    CHECK((found.head(half) - expected.head(half)).norm() < 1e-9);
    CHECK((found.tail(half) - expected.tail(half)).norm() < 1e-5);  // h^2/6 of the third derivative
  }
  CHECK(oscillating == 8);

  scene.joints.push_back(ball("again", "ground", vec("0", "0", "0"), "a", vec("0", "0", "0.4")));
  const Linearisation twice = Linearised(scene).x;
  REQUIRE(twice.eigenvalues.size() == 12);
  CHECK((twice.eigenvalues - x.eigenvalues).tail(8).norm() < 1e-9);
}

TEST_CASE("eigenvalues do not depend on the units of length", "[linearisation]") {
  const Linearisation one = Linearised(hanging_pendulum(), {}, {}).x;
  for (const double scale : {1e-6, 1e4}) {
    Scene scene = hanging_pendulum();
    scene.gravity = {0.0, -kGravity * scale, 0.0};
    scene.parameters[3].value *= scale;
    for (const int k : {1, 2}) scene.parameters[static_cast<std::size_t>(k)].value *= scale * scale;
    const double I = kInertia * scale * scale;
    scene.bodies[0].inertia = {I, I, I, 0.0, 0.0, 0.0};
    scene.bodies[0].position = {0.0, -kLength * scale, 0.0};
    const Linearisation x = Linearised(scene).x;
    REQUIRE(x.eigenvalues.size() == 2);
    CHECK(std::abs(x.eigenvalues(0) - one.eigenvalues(0)) < 1e-9 * std::abs(one.eigenvalues(0)));
  }
}

TEST_CASE("an input that moves the joints is refused", "[linearisation]") {
  CHECK_THROWS_WITH(Linearised(hanging_pendulum(), {3}), Catch::Contains("moves the joints"));
}
