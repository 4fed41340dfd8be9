#include "app/run/run.hpp"

#include <catch2/catch.hpp>

#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("springs and gravity keep the energy, dampers, actuators and laws do not", "[energy]") {
  Scene scene = testing::pendulum();
  CHECK(conserves_energy(scene));
  Tsda spring;
  spring.body2 = "bar", spring.stiffness = 10.0, spring.damping = f("c - 0.7");  // 0 at the parameter's value
  scene.forces.push_back({"s", spring});
  CHECK(conserves_energy(scene));
  scene.parameters[0].value = 0.8;
  CHECK_FALSE(conserves_energy(scene));
  spring.damping = 0.0, spring.actuator = 1.0;
  scene.forces[0].kind = spring;
  CHECK_FALSE(conserves_energy(scene));
  Rsda bearing;
  bearing.joint = "A", bearing.stiffness = 2.0;
  scene.forces[0].kind = bearing;
  CHECK(conserves_energy(scene));
  BushingSpec mount;
  mount.body2 = "bar", mount.stiffness = vec("1", "2", "3");
  scene.forces[0].kind = mount;
  CHECK(conserves_energy(scene));
  mount.torsional_damping[1] = 0.1;
  scene.forces[0].kind = mount;
  CHECK_FALSE(conserves_energy(scene));
  FrictionSpec friction;
  friction.joint = "A", friction.coulomb = 1.0, friction.smooth_velocity = 0.1;
  scene.forces[0].kind = friction;
  CHECK_FALSE(conserves_energy(scene));
  bearing.law = f("angle^3");
  scene.forces[0].kind = bearing;
  CHECK_FALSE(conserves_energy(scene));
}
