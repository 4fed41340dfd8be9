// Every joint and drive with a parameter in each number that it can carry, between bodies placed askew and moving: the
// gradient by TLM, adjoint and differences on the same steps. Positions and orientations of the second body are
// parameters, too: some joints take what the file leaves out from them.
#include <catch2/catch.hpp>

#include "core/mechanism/mechanism.hpp"
#include "core/scene/type_table.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Three parameters and the vector they make.
VectorField varied(Scene& scene, const std::string& name, double x, double y, double z) {
  add_parameters(scene, {{name + "x", x}, {name + "y", y}, {name + "z", z}});
  return vec(name + "x", name + "y", name + "z");
}

// Two bodies, each on a spring to the ground; "first" hangs on a ball.
Scene bodies_at_a_joint() {
  Scene s;
  s.gravity = {0.5, 0.2, -9.0};
  s.bodies.push_back(
      body("first", vec("0.2", "0.05", "-0.1"), vec("0", "0", "0"), RollPitchYawField{vec("0.1", "-0.2", "0.3")}));
  const VectorField place = varied(s, "r", 0.75, 0.25, 0.1), turn = varied(s, "o", 0.15, -0.1, 0.2);
  s.bodies.push_back(body("second", vec("0.1", "-0.05", "0.2"), place, RollPitchYawField{turn}));
  s.bodies[0].angular_velocity = vec("0.4", "-0.3", "0.6");
  s.bodies[1].angular_velocity = vec("-0.2", "0.5", "0.3"), s.bodies[1].velocity = vec("0.3", "-0.4", "0.2");
  for (const char* name : {"first", "second"}) {
    Tsda spring;
    spring.body2 = name, spring.point1 = vec("0.3", "0.9", "1.1"), spring.point2 = vec("0.3", "0.1", "0");
    spring.stiffness = 40.0, spring.damping = 1.0, spring.free_length = 0.6;
    s.forces.push_back({std::string(name) + "_spring", spring});
  }
  s.simulation.end_time = 0.2;
  s.simulation.integrator.rtol = 1e-7, s.simulation.integrator.atol = 1e-9;
  return s;
}

// The joint under test between the two bodies, each of its vectors varied.
Joint varied_joint(Scene& s, const std::string& type, bool normals) {
  const TypeRow& row = *find_row(kJointTypes, type);
  auto has = [&](const char* field) { return row[field] != Need::unknown; };
  const bool across = type == "universal" || type == "perpendicular";  // axis2 at right angles to axis1
  Joint j;
  j.name = "J", j.type = type, j.body1 = "first", j.body2 = "second";
  if (has("point1")) j.point1 = varied(s, "p", 0.4, 0.1, 0.05);
  if (has("point2")) j.point2 = varied(s, "q", -0.35, 0.02, 0.03);
  if (has("axis1")) j.axis1 = varied(s, "a", 0.1, 0.2, 1);
  if (has("axis2")) j.axis2 = across ? varied(s, "b", 1, 0.1, 0.2) : varied(s, "b", 0.15, -0.1, 1);
  if (has("normal1") && normals) {
    j.normal1 = varied(s, "m", 1, 0.1, -0.1);
    j.normal2 = varied(s, "n", 1, -0.05, 0.1);
  }
  if (has("length")) add_parameters(s, {{"length", 0.3}}), j.length = f("length");
  if (has("pitch")) add_parameters(s, {{"pitch", 0.4}}), j.pitch = f("pitch");
  return j;
}

Scene with_joint(const std::string& type, bool normals) {
  Scene s = bodies_at_a_joint();
  s.joints.push_back(ball("hang", "ground", vec("0", "0", "0"), "first", vec("0", "0", "0")));
  s.joints.push_back(varied_joint(s, type, normals));
  return s;
}

// "first" turns on a skew axis of the ground; a joint that has an angle or a displacement; what ties the two.
Scene with_tie(const std::string& type, bool normals) {
  Scene s = bodies_at_a_joint();
  Joint turn = hinge("turn", "ground", vec("0", "0", "0"), "first", vec("0", "0", "0"));
  turn.axis1 = varied(s, "c", 0.2, 0.1, 1), turn.axis2 = varied(s, "d", 0.1, -0.1, 1);
  s.joints.push_back(turn);
  s.joints.push_back(varied_joint(s, type == "gear" ? "revolute" : "cylindrical", normals));
  Joint tie;
  tie.name = "tie", tie.type = type, tie.joint1 = "turn", tie.joint2 = "J";
  add_parameters(s, {{"factor", type == "gear" ? -1.7 : 0.3}});
  (type == "gear" ? tie.ratio : tie.radius) = f("factor");
  s.joints.push_back(tie);
  return s;
}

Scene with_drive(const std::string& type, const std::string& coordinate) {
  Scene s = bodies_at_a_joint();
  s.joints.push_back(ball("hang", "ground", vec("0", "0", "0"), "first", vec("0", "0", "0")));
  const bool joint = type == "angle" || type == "displacement";
  if (joint) s.joints.push_back(varied_joint(s, "cylindrical", true));
  Drive d;
  d.name = "drive", d.type = type, d.coordinate = coordinate;
  if (joint) d.joint = "J";
  if (type == "coordinate") d.body = "second";
  if (type == "distance") {
    d.body2 = "second";
    d.point1 = varied(s, "p", 0.1, -0.6, 0.2), d.point2 = varied(s, "q", 0.2, 0.1, 0.1);
  }
  const double start = type == "distance" ? 1 : coordinate == "x" ? 0.8 : 0.1;
  add_parameters(s, {{"f0", start}, {"f1", 0.1}, {"w", 5.0}});
  d.law = f("f0 + f1*sin(w*t + f0)");
  s.drives.push_back(d);
  return s;
}

// g = sum c_i y_i^2 and the terminal cost sum c_i y_i: no entry of the state is left out.
struct AllOfY final : RunningCost, TerminalCost {
  static double weight(Eigen::Index i) { return 1 + 0.3 * std::sin(2.0 * static_cast<double>(i)); }
  double g(double, VecIn y, VecIn) const override {
    double sum = 0;
    for (Eigen::Index i = 0; i < y.size(); ++i) sum += weight(i) * y(i) * y(i);
    return sum;
  }
  void add_g_y(double, VecIn y, VecIn, double scale, VecOut out) const override {
    for (Eigen::Index i = 0; i < y.size(); ++i) out(i) += scale * 2 * weight(i) * y(i);
  }
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
  double value(VecIn y, VecIn) const override {
    double sum = 0;
    for (Eigen::Index i = 0; i < y.size(); ++i) sum += weight(i) * y(i);
    return sum;
  }
  void adjoint_init(VecIn y, VecIn, VecOut lambda, VecOut) const override {
    for (Eigen::Index i = 0; i < y.size(); ++i) lambda(i) = weight(i);
  }
};

std::vector<Cost> costs(const Mechanism& mechanism) {
  std::vector<Cost> list(2);
  list[0].running = point_cost(std::shared_ptr<const RunningCost>(std::make_shared<AllOfY>()), mechanism);
  list[1].terminal = point_cost(std::shared_ptr<const TerminalCost>(std::make_shared<AllOfY>()), mechanism);
  return list;
}

// idle: a parameter that nothing depends on.
void check_gradient(const Scene& scene, const std::string& idle = "") {
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs(mechanism));
  const SimulationResult adjoint = simulate_adjoint(mechanism, scene.simulation, costs(mechanism));
  INFO(tlm.message << adjoint.message);
  REQUIRE((tlm.ok() && adjoint.ok()));
  CHECK(tlm.statistics.max_position_violation < 1e-12);
  const RunOptions frozen{&tlm.steps, {}};
  auto psi = [&](Eigen::Index k, double h) {
    VectorXd at = rho;
    at(k) += h;
    const Mechanism there(scene, at);
    const SimulationResult run = simulate(there, scene.simulation, costs(there), {}, frozen);
    REQUIRE(run.ok());
    return run.psi;
  };
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    const std::string& name = scene.parameters[static_cast<std::size_t>(k)].name;
    INFO(name);
    // The normals of an angle that nothing uses move nothing.
    if (name[0] != 'm' && name[0] != 'n' && name != idle) CHECK(tlm.psi_rho.col(k).cwiseAbs().minCoeff() > 0);
    const double h = 1e-3;
    const VectorXd wide = (psi(k, h) - psi(k, -h)) / (2 * h), near = (psi(k, h / 2) - psi(k, -h / 2)) / h,
                   nearest = (psi(k, h / 4) - psi(k, -h / 4)) / (h / 2);
    const VectorXd once = (4 * near - wide) / 3, again = (4 * nearest - near) / 3,
                   difference = (16 * again - once) / 15;
    for (Eigen::Index o = 0; o < 2; ++o) {
      const double entry = tlm.psi_rho(o, k);
      CHECK(std::abs(adjoint.psi_rho(o, k) - entry) <= 1e-10 * std::max(std::abs(entry), 1e-3 * size));
      CHECK(std::abs(difference(o) - entry) <= 1e-7 * std::max(std::abs(entry), 1e-3 * size));
    }
  }
}

}  // namespace

TEST_CASE("the gradient goes through every number of every joint", "[gradient]") {
  for (const TypeRow& row : kJointTypes) {
    const std::string type(row.name);
    for (const bool normals : {false, true}) {
      if (normals && type != "gear" && type != "rack_pinion" && row["normal1"] == Need::unknown) continue;
      INFO(type << (normals ? " with normals" : ""));
      const bool ties = row["joint1"] != Need::unknown;
      check_gradient(ties ? with_tie(type, normals) : with_joint(type, normals));
    }
  }
}

TEST_CASE("the gradient goes through every number of every drive", "[gradient]") {
  for (const TypeRow& row : kDriveTypes) {
    const std::string type(row.name);
    const std::vector<std::string> coordinates =
        type == "coordinate" ? std::vector<std::string>{"x", "e2"} : std::vector<std::string>{""};
    for (const std::string& coordinate : coordinates) {
      INFO(type << " " << coordinate);
      check_gradient(with_drive(type, coordinate), coordinate == "x" ? "rx" : "");
    }
  }
}
