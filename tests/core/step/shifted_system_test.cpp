// (I - gamma f_y) x = b through the accelerations, against the same matrix from tangents of f.
#include "core/step/shifted_system.hpp"

#include <catch2/catch.hpp>

#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

void check_scene(const Scene& scene, double tolerance) {
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& data = mechanism.data();
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  const VectorXd &y = assembly.result().y, &angles = assembly.result().angles;
  SpatialDynamics dynamics(mechanism, scene.simulation.formulation);
  VectorXd ydot(y.size());
  REQUIRE(dynamics.evaluate(0, y, angles, ydot));
  dynamics.linearise_here();

  const ParameterBlock none = block_without_parameters(data);
  MatrixXd f_y(y.size(), y.size());
  LaneRows direction(y.size(), kLanes), change(y.size(), kLanes);
  for (Eigen::Index c = 0; c < y.size(); ++c) {
    direction.setZero();
    direction(c, 0) = 1;
    dynamics.tangent(none, direction, change);
    f_y.col(c) = change.col(0);
  }

  ShiftedSystem system(data, dynamics);
  system.linearise(0, y, angles, ydot.tail(y.size() / 2), VectorXd(dynamics.lambda()));
  for (const double gamma : {1e-3, 0.1, -0.05}) {
    REQUIRE(system.factor(gamma));
    const MatrixXd I_minus = MatrixXd::Identity(y.size(), y.size()) - gamma * f_y;
    const VectorXd b = VectorXd::Random(y.size());
    VectorXd x = b;
    system.solve(x, StageMatrix::kExact);
    INFO("gamma " << gamma);
    CHECK((I_minus * x - b).norm() < tolerance * I_minus.norm() * x.norm());
    x = b;
    system.solve_transposed(x, StageMatrix::kExact);
    CHECK((I_minus.transpose() * x - b).norm() < tolerance * I_minus.norm() * x.norm());
  }
}

}  // namespace

TEST_CASE("the shifted system is solved through the accelerations", "[shifted_system]") {
  check_scene(loaded_four_bar(), 1e-12);
  check_scene(point_pendulum(), 1e-12);
}

TEST_CASE("with redundant constraints it is solved all the same", "[shifted_system]") {
  check_scene(n_four_bar(2), 1e-11);  // planar loops of spatial revolutes
}
