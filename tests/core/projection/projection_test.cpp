#include "core/projection/projection.hpp"

#include <catch2/catch.hpp>

#include "core/start/assembly.hpp"
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
  const std::unique_ptr<Projector> projector = make_projector(mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector->solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector->project(0, {}, y_hat, y, solution));
  return y;
}

// The loaded four-bar, or a slotted lever and a rod: its Jacobian depends on where the bodies are, not on their
// orientations alone (distance, dot-2).
Scene scene_of(bool slots) {
  if (!slots) return loaded_four_bar();
  Scene s;
  add_parameters(s, {{"L", 1.3}, {"px", 0.2}, {"slant", 0.3}, {"m", 1.4}});
  s.bodies.push_back(body("lever", vec("0.4", "0.1", "0"), vec("0", "0", "0"), turned("0.2")));
  s.bodies.push_back(body("slider", vec("0.1", "px", "0.05"), vec("0.9", "0.4", "0.1"), turned("-0.4")));
  s.bodies[1].mass = f("m");
  s.bodies[0].angular_velocity = vec("0", "0", "1"), s.bodies[1].velocity = vec("0.4", "-0.2", "0.3");
  s.joints.push_back(ball("pivot", "ground", vec("0", "0", "0"), "lever", vec("0", "0", "0")));
  Joint slot;
  slot.name = "slot", slot.type = "point_on_line", slot.body1 = "lever", slot.body2 = "slider";
  slot.point1 = vec("0", "px", "0"), slot.point2 = vec("0.1", "0", "px"),
  slot.axis1 = vec("cos(slant)", "sin(slant)", "0");
  s.joints.push_back(slot);
  Joint rod;
  rod.name = "rod", rod.type = "distance", rod.body2 = "slider", rod.point1 = vec("0.5", "-0.8", "px");
  rod.point2 = vec("px", "0", "0"), rod.length = f("L");
  s.joints.push_back(rod);
  return s;
}

}  // namespace

TEST_CASE("projection meets positions and velocities to rounding and leaves what meets them", "[projection]") {
  const Scene scene = loaded_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const double drift = GENERATE(1e-2, 1e-5, 1e-9);
  const VectorXd y = projected(mechanism, drifted(mechanism, drift));
  const std::unique_ptr<Projector> projector = make_projector(mechanism, Projection::position_velocity);
  CHECK(projector->position_violation(0, {}, y) < 1e-14);
  CHECK(projector->velocity_violation(0, y) < 1e-13);
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
  const Scene scene = scene_of(GENERATE(false, true));
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const double drift = GENERATE(1e-2, 1e-4);
  const VectorXd y_hat = drifted(mechanism, drift);
  const std::unique_ptr<Projector> projector = make_projector(mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector->solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector->project(0, {}, y_hat, y, solution));
  REQUIRE(projector->linearise(0, {}, y_hat, y, solution));
  const double h = 1e-6;
  for (const ParameterBlock& block : parameter_blocks(mechanism.data())) {
    const LaneRows direction = LaneRows::Random(y.size(), kLanes);
    LaneRows out(y.size(), kLanes);
    projector->tangent(block, direction, out);
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
  const Scene scene = scene_of(GENERATE(false, true));
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  const Projection what = GENERATE(Projection::position_velocity, Projection::velocity);
  const double drift = GENERATE(1e-2, 1e-6);
  const VectorXd y_hat = drifted(mechanism, drift);
  const std::unique_ptr<Projector> projector = make_projector(mechanism, what);
  ProjectionSolution solution = projector->solution();
  VectorXd y(y_hat.size());
  REQUIRE(projector->project(0, {}, y_hat, y, solution));
  REQUIRE(projector->linearise(0, {}, y_hat, y, solution));
  const VectorXd w = VectorXd::Random(y.size());
  VectorXd y_hat_bar = VectorXd::Zero(y.size()), theta_bar = VectorXd::Zero(d.slots()),
           rho_bar = VectorXd::Zero(d.rho.size());
  projector->add_adjoint(w, y_hat_bar, theta_bar, rho_bar);
  d.add_to_rho(theta_bar, rho_bar);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows direction = LaneRows::Random(y.size(), kLanes);
    LaneRows out(y.size(), kLanes);
    projector->tangent(block, direction, out);
    for (int k = 0; k < kLanes; ++k) {
      const double backward =
          y_hat_bar.dot(direction.col(k)) + (block.parameter[k] < 0 ? 0 : rho_bar(block.parameter[k]));
      CHECK(std::abs(w.dot(out.col(k)) - backward) < 1e-12 * w.cwiseAbs().dot(out.col(k).cwiseAbs()));
    }
  }
}
