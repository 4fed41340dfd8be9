// Single bodies on one joint or spring: the tables that Project Chrono's unit tests take from MSC ADAMS, and
// independent end points. ../shared/cases.md, section C, holds the data of every case.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/body/euler_parameters.hpp"
#include "core/simulate/simulation.hpp"
#include "source_folder.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

const double kQuarter = std::acos(-1.0) / 2;

// 1 kg, inertia (0.04, 0.1, 0.1) about the centre of mass, which is at `com` of a body turned by `turn` about x.
Scene single_body(double turn, const VectorField& origin, const VectorField& com = {2.0, 0.0, 0.0}) {
  Scene s;
  s.gravity = {0.0, 0.0, -9.80665};
  Body b = plain_body("body", 1, {0.04, 0.1, 0.1, 0.0, 0.0, 0.0}, origin);
  b.com = com;
  b.orientation = AxisAngleField{vec("1", "0", "0"), turn};
  s.bodies.push_back(b);
  s.simulation.end_time = 5;
  s.simulation.integrator.type = "dopri853";
  s.simulation.integrator.rtol = 1e-12, s.simulation.integrator.atol = 1e-14;
  return s;
}

// The body's z axis is the joint's axis; it lies along (0, -sin turn, cos turn).
Scene on_joint(const std::string& type, double turn, const VectorField& origin) {
  Scene s = single_body(turn, origin);
  Joint j;
  j.name = "J", j.type = type, j.body2 = "body", j.point1 = origin;
  if (type != "spherical") {
    j.axis1 = VectorField{0.0, -std::sin(turn), std::cos(turn)}, j.axis2 = vec("0", "0", "1");
    j.normal1 = vec("1", "0", "0"), j.normal2 = vec("1", "0", "0");
  }
  s.joints.push_back(j);
  return s;
}

// A rod from a point of the ground to a point of the body, as long as it is at the start.
Scene on_rod(const VectorField& ground, const VectorField& com, const VectorField& from_com) {
  Scene s = single_body(0, com, {0.0, 0.0, 0.0});
  Joint j;
  j.name = "rod", j.type = "distance", j.body2 = "body", j.point1 = ground, j.point2 = from_com, j.length = 2.0;
  s.joints.push_back(j);
  return s;
}

Scene on_spring(double stiffness, double damping, double free_length, const VectorField& com) {
  Scene s = single_body(0, com, {0.0, 0.0, 0.0});
  Tsda spring;
  spring.body2 = "body", spring.point1 = vec("0", "0", "0");
  spring.stiffness = stiffness, spring.damping = damping, spring.free_length = free_length;
  s.forces.push_back({"spring", spring});
  return s;
}

Scene on_torsion_spring() {
  Scene s = on_joint("revolute", -kQuarter, {0.0, 0.0, 0.0});
  Rsda torsion;
  torsion.joint = "J", torsion.stiffness = 200.0, torsion.damping = 10.0;
  s.forces.push_back({"spring", torsion});
  return s;
}

// Tolerances beyond half a unit of the last printed digit, of positions [m], velocities [m/s], Euler parameters,
// angular velocities [rad/s], reactions [N]. Most tables are right to that digit.
struct Tolerance {
  double position = 1e-7, velocity = 1e-7, orientation = 1e-7, rate = 1e-7, reaction = 2e-3;
};
// Reactions scatter by about 1e-3 N in the tables: in Prismatic_Case02, where they are constant, by 8e-4.
// ADAMS ran with its default error tolerance: known of Spherical_Case01, visible in the fast tumbling (up to 9 rad/s)
// of Distance_Case02 and the decaying motion of RotSpring_Case01, where own end points below agree with ours to 1e-9.
constexpr Tolerance kLoose{1e-3, 3e-3, 3e-4, 2e-3, 2e-2}, kTumbling{5e-5, 5e-4, 5e-5, 2e-3, 2e-2},
    kDecaying{5e-6, 5e-5, 5e-6, 5e-5, 2e-3};

struct PublishedCase {
  std::string table;
  Scene scene;
  Tolerance tolerance = {};
};

std::vector<PublishedCase> cases() {
  const VectorField zero{0.0, 0.0, 0.0}, aside{1.0, 2.0, 3.0};
  return {{"Revolute_Case01", on_joint("revolute", -kQuarter, zero)},
          {"Revolute_Case02", on_joint("revolute", -kQuarter / 2, aside)},
          {"Spherical_Case01", on_joint("spherical", 0, zero), kLoose},
          {"Spherical_Case02", on_joint("spherical", -kQuarter / 2, aside)},
          {"Cylindrical_Case01", on_joint("cylindrical", 0, zero)},
          {"Cylindrical_Case02", on_joint("cylindrical", -kQuarter, zero)},
          {"Prismatic_Case01", on_joint("translational", 0, zero)},
          {"Prismatic_Case02", on_joint("translational", -kQuarter / 2, aside)},
          {"Prismatic_Case03", on_joint("translational", -kQuarter, aside)},
          {"Distance_Case01", on_rod(zero, {0.0, 2.0, 0.0}, zero)},
          {"Distance_Case02", on_rod(aside, {-1.0, 4.0, 3.0}, {2.0, 0.0, 0.0}), kTumbling},
          {"TranSpring_Case01", on_spring(10, 0.5, 0, zero)},
          {"TranSpring_Case02", on_spring(100, 5, 2, {0.0, 2.0, 0.0})},
          {"TranSpringCB_Case01", on_spring(10, 0.5, 0, zero)},
          {"TranSpringCB_Case02", on_spring(100, 5, 2, {0.0, 2.0, 0.0})},
          {"RotSpring_Case01", on_torsion_spring(), kDecaying}};
}

// Rows "time value...", header lines skipped.
std::vector<std::vector<double>> table(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(file, line);) {
    std::istringstream in(line);
    std::vector<double> row;
    for (double x = 0; in >> x;) row.push_back(x);
    if (!row.empty()) rows.push_back(row);
  }
  return rows;
}

double worst_beyond_printing(const std::vector<double>& row, const VectorXd& x) {
  double worst = 0;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    const double printed = row[static_cast<std::size_t>(k) + 1];
    const double half_unit = printed == 0 ? 0 : 0.5 * std::pow(10, std::floor(std::log10(std::abs(printed))) - 5);
    worst = std::max(worst, std::abs(x(k) - printed) - half_unit);
  }
  return worst;
}

Vector3d com_at_end(const Scene& scene) {
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), scene.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK(run.statistics.max_position_violation < 1e-12);
  return run.y_end.head<3>();
}

}  // namespace

TEST_CASE("single bodies on joints and springs follow the ADAMS tables over 5 s", "[reference]") {
  const std::filesystem::path folder =
      std::filesystem::path(MBSOPT_SOURCE_DIR) / "../shared/data/published/adams_single_body_joints";
  if (!std::filesystem::exists(folder)) {
    WARN("skipped: " << folder.string() << " is not there");
    return;
  }
  for (const PublishedCase& c : cases()) {
    auto read = [&](const char* what) { return table(folder / (c.table + "_ADAMS_" + what + ".txt")); };
    const auto position = read("Pos"), velocity = read("Vel"), orientation = read("Quat"), rate = read("Avel");
    INFO(c.table);
    REQUIRE(position.size() == 501);
    REQUIRE((velocity.size() == 501 && orientation.size() == 501 && rate.size() == 501));
    Sampling sampling;
    for (const auto& row : position) sampling.times.push_back(std::min(row[0], 5.0));
    // The tables give the force of the body on the joint: the opposite of the reaction on body 2.
    Scene scene = c.scene;
    for (const char* k : {"x", "y", "z"}) {
      if (scene.joints.empty()) continue;
      Sensor s;
      s.name = std::string("F") + k, s.quantity = "reaction", s.joint = scene.joints[0].name, s.kind = "force";
      s.component = k;
      scene.sensors.push_back(s);
    }
    const auto reaction = scene.joints.empty() ? std::vector<std::vector<double>>() : read("Rforce");
    const Mechanism mechanism(scene, VectorXd());
    Tolerance worst{0, 0, 0, 0, 0};
    sampling.observe = [&](std::size_t i, const StatePoint& at) {
      const Eigen::Vector4d p = at.y.segment<4>(3), pdot = at.y.segment<4>(10);
      const Vector3d omega = A(p) * omega_B(p, pdot);
      const auto& q = orientation[i];
      const double sign = p(0) * q[1] + p(1) * q[2] + p(2) * q[3] + p(3) * q[4] < 0 ? -1 : 1;
      worst.position = std::max(worst.position, worst_beyond_printing(position[i], at.y.head<3>()));
      worst.velocity = std::max(worst.velocity, worst_beyond_printing(velocity[i], at.y.segment<3>(7)));
      worst.orientation = std::max(worst.orientation, worst_beyond_printing(q, sign * p));
      worst.rate = std::max(worst.rate, worst_beyond_printing(rate[i], omega));
      if (reaction.empty()) return;
      const Vector3d F(mechanism.sensor_value(0, at), mechanism.sensor_value(1, at), mechanism.sensor_value(2, at));
      worst.reaction = std::max(worst.reaction, worst_beyond_printing(reaction[i], -F));
    };
    const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
    INFO(run.message);
    REQUIRE(run.ok());
    CHECK(worst.position < c.tolerance.position);
    CHECK(worst.velocity < c.tolerance.velocity);
    CHECK(worst.orientation < c.tolerance.orientation);
    CHECK(worst.rate < c.tolerance.rate);
    CHECK(worst.reaction < c.tolerance.reaction);
  }
}

TEST_CASE("single bodies on joints end where an independent solution does", "[reference]") {
  const VectorField zero{0.0, 0.0, 0.0}, aside{1.0, 2.0, 3.0};
  auto distance = [](const Scene& scene, const Vector3d& expected) { return (com_at_end(scene) - expected).norm(); };
  CHECK(distance(on_joint("revolute", -kQuarter, zero), {-1.99968386888, 0, -0.0355587475452}) < 1e-9);
  CHECK(distance(on_joint("revolute", -kQuarter / 2, aside), {1.20996050741, 3.40639905171, 1.59360094829}) < 1e-9);
  CHECK(distance(on_joint("spherical", -kQuarter / 2, aside), {-0.999683868884, 2, 2.96444125245}) < 1e-9);
  CHECK(distance(on_joint("cylindrical", -kQuarter, zero), {-1.99968386888, 0, -0.0355587475452}) < 1e-9);
  CHECK(distance(on_rod(aside, {-1.0, 4.0, 3.0}, {2.0, 0.0, 0.0}), {0.365244913601, 2.66492163703, -0.790966797391}) <
        1e-9);
}

TEST_CASE("single bodies on springs end where an independent solution does", "[reference]") {
  auto distance = [](const Scene& scene, const Vector3d& expected) { return (com_at_end(scene) - expected).norm(); };
  CHECK(distance(on_spring(100, 5, 2, {0.0, 2.0, 0.0}), {0, -1.94519785045, -0.767400995044}) < 1e-9);
  CHECK(distance(on_torsion_spring(), {1.99043912706, 0, -0.195325578162}) < 1e-9);
}

TEST_CASE("bodies that slide, fall or hang on a spring end where the closed form says", "[reference]") {
  const double g = 9.80665, t = 5;
  const VectorField zero{0.0, 0.0, 0.0}, aside{1.0, 2.0, 3.0};
  auto distance = [](const Scene& scene, const Vector3d& expected) { return (com_at_end(scene) - expected).norm(); };
  const double fall = g * t * t / 2;
  CHECK(distance(single_body(0.3, zero), {2, 0, -fall}) < 1e-11);
  CHECK(distance(on_joint("cylindrical", 0, zero), {2, 0, -fall}) < 1e-11);
  CHECK(distance(on_joint("translational", 0, zero), {2, 0, -fall}) < 1e-11);
  // along (0, 1, 1)/sqrt(2) with the acceleration -g/sqrt(2)
  CHECK(distance(on_joint("translational", -kQuarter / 2, aside), {3, 2 - fall / 2, 3 - fall / 2}) < 1e-11);
  CHECK(distance(on_joint("translational", -kQuarter, aside), {3, 2, 3}) < 1e-11);
  // m z'' + c z' + k z = -m g from rest in z = 0, where the spring has no direction
  const double k = 10, c = 0.5, delta = c / 2, omega = std::sqrt(k - delta * delta);
  const double z = -g / k * (1 - std::exp(-delta * t) * (std::cos(omega * t) + delta / omega * std::sin(omega * t)));
  CHECK(distance(on_spring(k, c, 0, zero), {0, 0, z}) < 1e-9);
}
