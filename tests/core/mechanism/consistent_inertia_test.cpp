#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <catch2/catch.hpp>
#include <random>

#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/inertia_check.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

const std::vector<std::string> kNames{"m", "x", "y", "z", "xy", "xz", "yz"};

Scene free_body() {
  Scene scene;
  for (const std::string& name : kNames) add_parameters(scene, {{name, 1}});
  Body b = body("body", vec("0", "0", "0"), vec("0", "0", "0"), EulerParametersField());
  b.mass = f("m");
  b.consistent_inertia = ConsistentInertiaField{f("x"), f("y"), f("z"), f("xy"), f("xz"), f("yz")};
  scene.bodies = {b};
  return scene;
}

Eigen::Matrix3d tensor(const Scene& scene, const Eigen::VectorXd& rho) {
  return Mechanism(scene, rho).data().bodies[1].J;
}

Eigen::VectorXd random_lengths(std::mt19937& generator) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd rho(7);
  for (double& x : rho) x = normal(generator);
  rho(0) = std::exp(rho(0));
  return rho;
}

}  // namespace

TEST_CASE("a consistent inertia is that of a possible body, whatever the lengths", "[inertia]") {
  std::mt19937 generator(5);
  const Scene scene = free_body();
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd rho = random_lengths(generator);
    if (i % 4 == 0) rho(1 + i % 3) = 0;  // also flat ones
    const Eigen::Matrix3d J = tensor(scene, rho);
    CHECK(J == J.transpose());
    CHECK(inertia_problem({J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(0, 2), J(1, 2)}).empty());
  }
}

TEST_CASE("every possible tensor has its lengths: those of the Cholesky factor of its second moments", "[inertia]") {
  std::mt19937 generator(7);
  const Scene scene = free_body();
  for (int i = 0; i < 20; ++i) {
    // Second moments S of points with masses; J = tr(S) I - S; S/m = U U' with U upper: Cholesky of the reversed
    // matrix.
    std::normal_distribution<double> normal;
    Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d r(normal(generator), normal(generator), normal(generator));
      S += 0.3 * r * r.transpose();
    }
    const double m = 1.5;
    const Eigen::Matrix3d reversed = (S / m).colwise().reverse().rowwise().reverse();
    const Eigen::Matrix3d L = reversed.llt().matrixL();
    const Eigen::Matrix3d U = L.colwise().reverse().rowwise().reverse();
    Eigen::VectorXd rho(7);
    rho << m, U(0, 0), U(1, 1), U(2, 2), U(0, 1), U(0, 2), U(1, 2);
    const Eigen::Matrix3d J = S.trace() * Eigen::Matrix3d::Identity() - S;
    CHECK((tensor(scene, rho) - J).norm() < 1e-13 * J.norm());
  }
}

TEST_CASE("without shears the lengths are root-mean-square extents", "[inertia]") {
  Eigen::VectorXd rho(7);
  const double L = 2, w = 0.3;  // a rod along z, w wide in x, of 3 kg
  rho << 3, w / std::sqrt(12.), 0, L / std::sqrt(12.), 0, 0, 0;
  const Eigen::Matrix3d J = tensor(free_body(), rho);
  CHECK(J(0, 0) == Approx(3 * L * L / 12));
  CHECK(J(1, 1) == Approx(3 * (L * L + w * w) / 12));
  CHECK(J(2, 2) == Approx(3 * w * w / 12));
  CHECK(J(0, 1) == 0);
}

TEST_CASE("the derivatives of a consistent inertia are those of differences", "[inertia]") {
  std::mt19937 generator(9);
  const Scene scene = free_body();
  const Eigen::VectorXd rho = random_lengths(generator);
  const Mechanism mechanism(scene, rho);
  const MechanismData& d = mechanism.data();
  const int slot = d.bodies[1].slot_J;
  REQUIRE(slot >= 0);
  for (Eigen::Index k = 0; k < 7; ++k) {
    constexpr double h = 1e-4;  // the tensor is of second order in a length: central differences are exact
    Eigen::VectorXd plus = rho, minus = rho;
    plus(k) += h, minus(k) -= h;
    const Eigen::Matrix3d D = (tensor(scene, plus) - tensor(scene, minus)) / (2 * h);
    Eigen::VectorXd expected(6);
    expected << D(0, 0), D(1, 1), D(2, 2), D(0, 1), D(0, 2), D(1, 2);
    CHECK((d.theta_rho.col(k).segment(slot, 6) - expected).norm() < 1e-9 * (1 + expected.norm()));
  }
}
