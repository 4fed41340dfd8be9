#include "app/report/motion_scene.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/results/objective_units.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The pendulum's bar turned about z.
std::vector<double> bar_turned(double t, double angle) {
  return {t, 0, 0, 0, std::cos(angle / 2), 0, 0, std::sin(angle / 2), 0, 0, 0, 0, 0, 1};
}

constexpr MotionPlane kPlane{{0, 1}, true};

}  // namespace

TEST_CASE("a motion holds what moves as arrays and what rests as numbers", "[report]") {
  const Scene scene = pendulum();
  const Trajectory swing{{}, {bar_turned(0, 0), bar_turned(0.5, 0.2), bar_turned(1, 0.4)}};
  const Json motion = motion_scene(kPlane, {{"bar", scene, swing}});
  CHECK(motion.at("planar") == true);
  const auto& state = motion.at("states")[0];
  CHECK(state.at("t") == Json({0, 0.5, 1}));
  const auto& pose = state.at("bodies")[0].at("pose");
  CHECK(pose[0] == 0);
  REQUIRE(pose[6].is_array());
  CHECK(pose[6][2].get<double>() == Approx(std::sin(0.2)).epsilon(1e-5));
  REQUIRE(state.at("marks").size() == 3);  // the ground, a line along the axis, the joint
  CHECK(state.at("marks")[0].at("style") == "ground");
  CHECK(state.at("marks")[0].at("at").at("b") == -1);
  CHECK(state.at("marks")[1].at("foreshortened") == true);
  CHECK(state.at("marks")[2].at("at").at("b") == 0);
}

TEST_CASE("a motion holds what its points should follow and the forces of its joints", "[report]") {
  Scene scene = pendulum();
  Sensor x;
  x.name = "x", x.quantity = "position", x.body = scene.bodies[0].name, x.point = VectorField{1.0, 0.0, 0.0};
  x.component = "x";
  Sensor y = x;
  y.name = "y", y.component = "y";
  scene.sensors = {x, y};
  const std::vector<PointTarget> targets =
      point_targets(scene, {{"x", {0, 0.5}, {1, 2}}, {"y", {0, 0.5}, {3, 4}}, {"no sensor", {0}, {1}}}, false);
  REQUIRE(targets.size() == 1);
  const Trajectory swing{{}, {bar_turned(0, 0), bar_turned(1, 0.4)}};
  const std::string joint = scene.joints[0].name;
  const Trajectory forces{{"t", joint + ".x", joint + ".y", joint + ".z"}, {{0, 3, 4, 0}, {1, 0, 1, 0}}};
  const Json motion = motion_scene(kPlane, {{"bar", scene, swing, false, targets, forces}});
  const auto& state = motion.at("states")[0];
  const auto& target = state.at("targets")[0];
  CHECK(target.at("at").at("b") == 0);
  CHECK(target.at("place")[0] == Json({1, 2}));
  CHECK(target.at("place")[1] == Json({3, 4}));
  CHECK(target.at("place")[2].is_null());
  CHECK(state.at("reactions").at("large") == 5);
  CHECK(state.at("reactions").at("joints")[0].at("force")[1] == Json({4, 1}));
}

TEST_CASE("a motion out of its plane is not planar, one without two rows or with infinite poses is none", "[report]") {
  const Scene scene = pendulum();
  Trajectory swing{{}, {bar_turned(0, 0), bar_turned(1, 0.4)}};
  swing.rows[1][3] = 0.1;
  CHECK_FALSE(plane_of_motion(scene, swing).holds_all);
  swing.rows[1][3] = std::numeric_limits<double>::infinity();
  CHECK(motion_scene(kPlane, {{"bar", scene, swing}}).is_null());
  swing.rows.pop_back();
  CHECK(motion_scene(kPlane, {{"bar", scene, swing}}).is_null());
}

TEST_CASE("a long motion is thinned, keeps its end, and says so", "[report]") {
  const Scene scene = pendulum();
  Trajectory swing;
  for (int k = 0; k <= 100'000; ++k) swing.rows.push_back(bar_turned(k, k * 1e-4));
  const Json motion = motion_scene(kPlane, {{"bar", scene, swing}});
  const Json& t = motion.at("states")[0].at("t");
  CHECK(t.size() < 3000);
  CHECK(t.back() == 100'000);
  CHECK(motion.at("note") == "The motion shows every 36th of 100001 rows of trajectory.csv.");
}

TEST_CASE("a force has the unit of what it acts along", "[report]") {
  Scene scene;
  Drive slide, turn;
  slide.name = "slide", slide.type = "displacement", turn.name = "turn", turn.type = "angle";
  scene.drives = {slide, turn};
  scene.forces = {{"spring", Tsda{}}, {"bar", TorsionBar{}}};
  Sensor sensor;
  sensor.quantity = "drive_force";
  sensor.drive = "slide";
  CHECK(unit_in(scene, sensor) == "N");
  sensor.drive = "turn";
  CHECK(unit_in(scene, sensor) == "N m");
  sensor.quantity = "force";
  sensor.force = "spring";
  CHECK(unit_in(scene, sensor) == "N");
  sensor.force = "bar";
  CHECK(unit_in(scene, sensor) == "N m");
  sensor.quantity = "reaction", sensor.kind = "torque";
  CHECK(unit_in(scene, sensor) == "N m");
}
