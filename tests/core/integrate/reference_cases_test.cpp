// Published and independently computed motions: ../shared/cases.md holds the figures and their sources.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/integrate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

void set_accuracy(Scene& scene, const std::string& method, double rtol) {
  scene.simulation.integrator.type = method;
  scene.simulation.integrator.rtol = rtol;
  scene.simulation.integrator.atol = 0.01 * rtol;
}

// Chrono's single-body cases: 1 kg, inertia (0.04, 0.1, 0.1), centre of mass 2 m along x of a body turned by `turn`
// about x.
Scene chrono_body(double turn, const VectorField& origin) {
  Scene s;
  s.gravity = {0.0, 0.0, -9.80665};
  Body b = plain_body("body", 1, {0.04, 0.1, 0.1, 0.0, 0.0, 0.0}, origin);
  b.com = {2.0, 0.0, 0.0};
  b.orientation = AxisAngleField{vec("1", "0", "0"), turn};
  s.bodies.push_back(b);
  s.simulation.end_time = 5;
  set_accuracy(s, "dopri853", 1e-10);
  return s;
}

// The hinge of these cases: the body's z axis, which is the global direction `axis`.
Joint chrono_hinge(const VectorField& origin, const VectorField& axis) {
  Joint j = hinge("J", "ground", origin, "body", vec("0", "0", "0"));
  j.axis1 = axis;
  j.normal1 = vec("1", "0", "0"), j.normal2 = vec("1", "0", "0");
  return j;
}

Eigen::Vector3d com_at_end(const Scene& scene) {
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  return run.y_end.head<3>();
}

// Largest distance between the motion and a table of times and positions ("time x y z", header lines skipped).
double worst_distance(const Scene& scene, const std::filesystem::path& table) {
  std::ifstream file(table);
  Sampling sampling;
  std::vector<Eigen::Vector3d> expected;
  for (std::string line; std::getline(file, line);) {
    std::istringstream row(line);
    double t = 0;
    Eigen::Vector3d x;
    if (row >> t >> x(0) >> x(1) >> x(2) && t <= scene.simulation.end_time) {
      sampling.times.push_back(t);
      expected.push_back(x);
    }
  }
  REQUIRE(expected.size() > 100);
  double worst = 0;
  sampling.observe = [&](std::size_t i, const StatePoint& at) {
    worst = std::max(worst, (at.y.head<3>() - expected[i]).norm());
  };
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation, {}, sampling);
  REQUIRE(run.ok());
  return worst;
}

std::filesystem::path adams_tables() {
  return std::filesystem::path(MBSOPT_SOURCE_DIR) / "../shared/data/published/adams_single_body_joints";
}

}  // namespace

TEST_CASE("A01: the simple pendulum is right at 10 s to 1e-8 m", "[reference]") {
  Scene scene = point_pendulum();
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  set_accuracy(scene, method, 1e-10);
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation);
  REQUIRE(run.ok());
  INFO(method);
  CHECK(std::abs(run.y_end(0) + 0.2750874625761169) < 1e-8);
  CHECK(std::abs(run.y_end(1) + 0.9614192050991251) < 1e-8);
  CHECK(std::abs(run.y_end(7) - 4.175598100951729) < 1e-8);
  CHECK(std::abs(run.y_end(8) + 1.194749054560475) < 1e-8);
  CHECK(run.statistics.max_position_violation < 1e-12);
}

TEST_CASE("A02: two four-bar windows through their singular positions are right at 10 s to 1e-7 m", "[reference]") {
  Scene scene = n_four_bar(2);
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  set_accuracy(scene, method, 1e-10);
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  INFO(method);
  const VectorXd angles;
  const StatePoint end{10, run.y_end, angles};
  CHECK(std::abs(mechanism.sensor_value(0, end) - 0.3284581115408154) < 1e-7);
  CHECK(std::abs(mechanism.sensor_value(1, end) - 0.944518538178601) < 1e-7);
}

TEST_CASE("A02: forty windows stay on their branch", "[reference]") {
  Scene scene = n_four_bar(40);
  scene.simulation.end_time = 4;
  set_accuracy(scene, "dopri853", 1e-8);
  const Mechanism mechanism(scene, VectorXd());
  const SimulationResult run = simulate(mechanism, scene.simulation);
  REQUIRE(run.ok());
  const VectorXd angles;
  const StatePoint end{4, run.y_end, angles};
  CHECK(std::abs(mechanism.sensor_value(0, end) - 0.06934203222799917) < 5e-6);
  CHECK(std::abs(mechanism.sensor_value(1, end) - 0.9975929443247336) < 5e-6);
}

TEST_CASE("single bodies on revolute and spherical joints end where an independent solution does", "[reference]") {
  const double quarter = std::acos(-1.0) / 4;
  Scene revolute01 = chrono_body(-2 * quarter, vec("0", "0", "0"));
  revolute01.joints.push_back(chrono_hinge(vec("0", "0", "0"), vec("0", "1", "0")));
  CHECK((com_at_end(revolute01) - Eigen::Vector3d(-1.99968386888, 0, -0.0355587475452)).norm() < 1e-9);

  Scene revolute02 = chrono_body(-quarter, vec("1", "2", "3"));
  revolute02.joints.push_back(chrono_hinge(vec("1", "2", "3"), vec("0", "sin(pi/4)", "cos(pi/4)")));
  CHECK((com_at_end(revolute02) - Eigen::Vector3d(1.20996050741, 3.40639905171, 1.59360094829)).norm() < 1e-9);

  Scene spherical02 = chrono_body(-quarter, vec("1", "2", "3"));
  spherical02.joints.push_back(ball("J", "ground", vec("1", "2", "3"), "body", vec("0", "0", "0")));
  CHECK((com_at_end(spherical02) - Eigen::Vector3d(-0.999683868884, 2, 2.96444125245)).norm() < 1e-9);
}

TEST_CASE("springs on single bodies end where an independent solution does", "[reference]") {
  Scene rotational = chrono_body(-std::acos(-1.0) / 2, vec("0", "0", "0"));
  rotational.joints.push_back(chrono_hinge(vec("0", "0", "0"), vec("0", "1", "0")));
  Rsda torsion;
  torsion.joint = "J", torsion.stiffness = 200.0, torsion.damping = 10.0;
  rotational.forces.push_back({"spring", torsion});
  CHECK((com_at_end(rotational) - Eigen::Vector3d(1.99043912706, 0, -0.195325578162)).norm() < 1e-9);

  Scene translational = chrono_body(0, vec("-2", "2", "0"));
  Tsda spring;
  spring.body2 = "body", spring.point2 = vec("2", "0", "0"), spring.point1 = vec("0", "0", "0");
  spring.stiffness = 100.0, spring.damping = 5.0, spring.free_length = 2.0;
  translational.forces.push_back({"spring", spring});
  CHECK((com_at_end(translational) - Eigen::Vector3d(0, -1.94519785045, -0.767400995044)).norm() < 1e-9);
}

TEST_CASE("single bodies follow the ADAMS tables to 5e-5 m over 5 s", "[reference]") {
  const std::filesystem::path tables = adams_tables();
  if (!std::filesystem::exists(tables)) {
    WARN("skipped: " << tables.string() << " is not there");
    return;
  }
  const double quarter = std::acos(-1.0) / 4;
  Scene revolute02 = chrono_body(-quarter, vec("1", "2", "3"));
  revolute02.joints.push_back(chrono_hinge(vec("1", "2", "3"), vec("0", "sin(pi/4)", "cos(pi/4)")));
  CHECK(worst_distance(revolute02, tables / "Revolute_Case02_ADAMS_Pos.txt") < 5e-5);
  Scene spherical02 = chrono_body(-quarter, vec("1", "2", "3"));
  spherical02.joints.push_back(ball("J", "ground", vec("1", "2", "3"), "body", vec("0", "0", "0")));
  CHECK(worst_distance(spherical02, tables / "Spherical_Case02_ADAMS_Pos.txt") < 5e-5);
}
