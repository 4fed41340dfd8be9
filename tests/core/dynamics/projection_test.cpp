#include "core/dynamics/projection.hpp"

#include <catch2/catch.hpp>

#include "core/dynamics/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// An assembled, moving state disturbed by `drift` in every number.
VectorXd drifted(const Mechanism& mechanism, double drift) {
  std::srand(4);
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  return assembly.result().y + drift * VectorXd::Random(mechanism.states());
}

VectorXd projected(const Mechanism& mechanism, const VectorXd& y_hat) {
  Projector projector(mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector.solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector.project(0, {}, y_hat, y, solution));
  return y;
}

}  // namespace

TEST_CASE("projection meets positions and velocities to rounding and leaves what meets them", "[projection]") {
  const Scene scene = loaded_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const double drift = GENERATE(1e-2, 1e-5, 1e-9);
  const VectorXd y = projected(mechanism, drifted(mechanism, drift));
  Projector projector(mechanism, Projection::position_velocity);
  CHECK(projector.position_violation(0, {}, y) < 1e-14);
  CHECK(projector.velocity_violation(0, y) < 1e-13);
  CHECK((projected(mechanism, y) - y).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("a particle on a rod is projected along the rod: the mass-orthogonal direction", "[projection]") {
  const Scene scene = point_pendulum();
  const Mechanism mechanism(scene, VectorXd());
  const Assembly assembly(mechanism, 0);
  VectorXd y = assembly.result().y;
  y(0) -= 0.01, y(8) = 2, y(7) = 0.3;  // 1 cm too far out; the velocity has a part along the rod
  const VectorXd p = projected(mechanism, y);
  CHECK(p(0) == Approx(-1).epsilon(1e-13));
  CHECK(std::abs(p(1)) < 1e-13);
  CHECK(std::abs(p(7)) < 1e-13);
  CHECK(p(8) == Approx(2).epsilon(1e-13));
}

TEST_CASE("tangent of the projection equals central differences", "[projection]") {
  const Scene scene = loaded_four_bar();
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const double drift = GENERATE(1e-2, 1e-4);
  const VectorXd y_hat = drifted(mechanism, drift);
  Projector projector(mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector.solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector.project(0, {}, y_hat, y, solution));
  REQUIRE(projector.linearise(0, {}, y_hat, y, solution));
  const double h = 1e-6;
  for (const ParameterBlock& block : parameter_blocks(mechanism.data())) {
    const LaneRows direction = LaneRows::Random(y.size(), kLanes);
    LaneRows out(y.size(), kLanes);
    projector.tangent(block, direction, out);
    for (int k = 0; k < kLanes; ++k) {
      VectorXd up = rho, down = rho;
      if (block.parameter[k] >= 0) up(block.parameter[k]) += h, down(block.parameter[k]) -= h;
      const VectorXd e = h * direction.col(k);
      const VectorXd difference =
          (projected(Mechanism(scene, up), y_hat + e) - projected(Mechanism(scene, down), y_hat - e)) / (2 * h);
      CHECK((difference - out.col(k)).cwiseAbs().maxCoeff() < 1e-7 * (1 + out.cwiseAbs().maxCoeff()));
    }
  }
}

TEST_CASE("the adjoint of the projection is the transpose of its tangent", "[projection]") {
  const Scene scene = loaded_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  const Projection what = GENERATE(Projection::position_velocity, Projection::velocity);
  const double drift = GENERATE(1e-2, 1e-6);
  const VectorXd y_hat = drifted(mechanism, drift);
  Projector projector(mechanism, what);
  ProjectionSolution solution = projector.solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector.project(0, {}, y_hat, y, solution));
  REQUIRE(projector.linearise(0, {}, y_hat, y, solution));
  const VectorXd w = VectorXd::Random(y.size());
  VectorXd y_hat_bar = VectorXd::Zero(y.size()), theta_bar = VectorXd::Zero(d.slots()),
           rho_bar = VectorXd::Zero(d.rho.size());
  projector.add_adjoint(w, y_hat_bar, theta_bar, rho_bar);
  d.add_to_rho(theta_bar, rho_bar);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows direction = LaneRows::Random(y.size(), kLanes);
    LaneRows out(y.size(), kLanes);
    projector.tangent(block, direction, out);
    for (int k = 0; k < kLanes; ++k) {
      const double backward =
          y_hat_bar.dot(direction.col(k)) + (block.parameter[k] < 0 ? 0 : rho_bar(block.parameter[k]));
      CHECK(std::abs(w.dot(out.col(k)) - backward) < 1e-12 * w.cwiseAbs().dot(out.col(k).cwiseAbs()));
    }
  }
}
