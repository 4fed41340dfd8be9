#include "optim/problem/unused_parameters.hpp"

#include <catch2/catch.hpp>

#include "optim/objective/problem_issues.hpp"

using namespace mbsopt;

namespace {

Body body(const std::string& name, const Field& mass) {
  Body b;
  b.name = name;
  b.mass = mass;
  b.inertia = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  return b;
}

Joint revolute(const std::string& name, const std::string& body1, const std::string& body2) {
  Joint joint;
  joint.name = name;
  joint.type = "revolute";
  joint.body1 = body1;
  joint.body2 = body2;
  joint.axis1 = joint.axis2 = VectorField{0.0, 0.0, 1.0};
  return joint;
}

Sensor height(const std::string& name, const std::string& of) {
  Sensor sensor;
  sensor.name = name;
  sensor.quantity = "position";
  sensor.body = of;
  sensor.component = "y";
  return sensor;
}

// Two pendulums, a and b, that share nothing but the ground.
Problem two_pendulums() {
  Problem problem;
  Scene& scene = problem.scene;
  scene.parameters = {{"ma", 1.0}, {"mb", 1.0}};
  scene.bodies = {body("a", Expression::parse("ma")), body("b", Expression::parse("mb"))};
  scene.joints = {revolute("A", "ground", "a"), revolute("B", "ground", "b")};
  scene.sensors = {height("ya", "a"), height("yb", "b")};
  return problem;
}

void add_objective(Problem& problem, const std::string& running) {
  ObjectiveSpec objective;
  objective.name = "psi" + std::to_string(problem.objectives.size());
  objective.running = Expression::parse(running);
  problem.objectives.push_back(objective);
}

std::vector<std::string> unused(const Problem& problem) {
  for (const SceneIssue& issue : find_issues(problem)) FAIL(issue.path << ": " << issue.message);
  std::vector<std::string> paths;
  for (const SceneIssue& issue : find_unused_parameters(problem)) paths.push_back(issue.path);
  return paths;
}

using Paths = std::vector<std::string>;

}  // namespace

TEST_CASE("without objectives any use in the model counts", "[unused]") {
  Problem problem = two_pendulums();
  CHECK(unused(problem) == Paths{});
  problem.scene.parameters.push_back({"spare", 1.0});
  CHECK(unused(problem) == Paths{"parameters.spare"});
  problem.scene.parameters.back().allow_unused = true;
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("a parameter of bodies that no objective sees cannot matter", "[unused]") {
  Problem problem = two_pendulums();
  add_objective(problem, "ya^2");
  CHECK(unused(problem) == Paths{"parameters.mb"});
  CHECK_THAT(find_unused_parameters(problem).at(0).message, Catch::Contains("cannot influence any objective"));
  add_objective(problem, "yb");
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("joints, forces and conditions connect bodies, the ground does not", "[unused]") {
  Problem problem = two_pendulums();
  add_objective(problem, "ya^2");
  Problem jointed = problem;
  jointed.scene.joints.push_back(revolute("C", "a", "b"));
  CHECK(unused(jointed) == Paths{});
  Problem sprung = problem;
  Tsda tsda;
  tsda.body1 = "b";
  tsda.body2 = "a";
  sprung.scene.forces.push_back({"s", tsda});
  CHECK(unused(sprung) == Paths{});
  Problem conditioned = problem;
  Sensor distance;
  distance.name = "d";
  distance.quantity = "distance";
  distance.body1 = "a";
  distance.body2 = "b";
  conditioned.scene.sensors.push_back(distance);
  conditioned.scene.conditions.push_back({"d", Expression(1.0), {}});
  CHECK(unused(conditioned) == Paths{});
}

TEST_CASE("energy and constraint violation look at everything", "[unused]") {
  for (const char* quantity : {"energy", "constraint_violation"}) {
    Problem problem = two_pendulums();
    Sensor sensor;
    sensor.name = "e";
    sensor.quantity = quantity;
    if (sensor.quantity == "energy") sensor.component = "total";
    problem.scene.sensors.push_back(sensor);
    add_objective(problem, "e");
    CHECK(unused(problem) == Paths{});
  }
}

TEST_CASE("an objective of parameters alone sees no body", "[unused]") {
  Problem problem = two_pendulums();
  ObjectiveSpec objective;
  objective.name = "cost";
  objective.parameters_only = Expression::parse("ma^2 + 0*mb");
  problem.objectives.push_back(objective);
  CHECK(unused(problem) == Paths{"parameters.mb"});
}

TEST_CASE("parameters of sensors matter where the sensor is used", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"s", 0.1});
  problem.scene.sensors[0].point = VectorField{Expression::parse("s"), 0.0, 0.0};
  add_objective(problem, "yb + 0*ya");
  CHECK(unused(problem) == Paths{"parameters.ma", "parameters.s"});
  add_objective(problem, "ya");
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("an expression of sensors looks at what these look at", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"s", 0.1});
  Sensor mixed;
  mixed.name = "mixed", mixed.quantity = "expression", mixed.value = Expression::parse("s*deep");
  Sensor deep = mixed;
  deep.name = "deep", deep.value = Expression::parse("2*yb");
  problem.scene.sensors.insert(problem.scene.sensors.begin(), {mixed, deep});
  add_objective(problem, "ya");
  CHECK(unused(problem) == Paths{"parameters.mb", "parameters.s"});
  add_objective(problem, "mixed^2");
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("named points matter where something uses them", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"s", 0.1});
  problem.scene.bodies[0].points["tip"] = {Expression::parse("s"), 0.0, 0.0};
  CHECK(unused(problem) == Paths{"parameters.s"});
  problem.scene.joints[0].point2 = "tip";
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("coefficients that a law replaces do not matter, the law's parameters do", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"k", 1.0});
  problem.scene.parameters.push_back({"c", 1.0});
  problem.scene.parameters.push_back({"d", 1.0});
  problem.scene.definitions.push_back({"twice", Expression::parse("2*d")});
  Tsda tsda;
  tsda.body2 = "a";
  tsda.law = Expression::parse("c*l + twice*ldot");
  problem.scene.forces.push_back({"s", tsda});
  CHECK(unused(problem) == Paths{"parameters.k"});
  std::get<Tsda>(problem.scene.forces[0].kind).stiffness = Expression::parse("k");
  const auto issues = find_unused_parameters(problem);
  REQUIRE(issues.size() == 1);
  CHECK_THAT(issues[0].message, Catch::Contains("only by coefficients that a law replaces"));
}

TEST_CASE("a variable must matter to what the design uses, or to what is measured", "[unused]") {
  Problem problem = two_pendulums();
  add_objective(problem, "ya^2");
  add_objective(problem, "yb^2");
  problem.design.emplace();
  problem.design->minimize = "psi0", problem.design->variables = {"ma", "mb"};
  CHECK(unused(problem) == Paths{});
  const auto issues = find_idle_variables(problem);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].path == "design.variables[1]");
  problem.scene.parameters[1].allow_unused = true;
  CHECK(find_idle_variables(problem).empty());
  problem.scene.parameters[1].allow_unused = false;
  problem.design->subject_to = {{"psi1", {}, 1.0}};
  CHECK(find_idle_variables(problem).empty());

  ExperimentSpec experiment;
  experiment.channels.push_back({"theta", "ya", "", false, 1.0, 1.0, 0.0});
  problem.identification.emplace();
  problem.identification->experiments = {experiment};
  problem.identification->variables = {"mb"};
  REQUIRE(find_idle_variables(problem).size() == 1);
  CHECK(find_idle_variables(problem)[0].path == "identification.variables[0]");
  problem.identification->variables = {"ma"};
  problem.identification->experiments[0].free = {"mb"};
  REQUIRE(find_idle_variables(problem).size() == 1);
  CHECK(find_idle_variables(problem)[0].path == "identification.experiments[0].free[0]");
}

TEST_CASE("a parameter that every load case replaces is in use, but no variable", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters[1].allow_unused = true;
  add_objective(problem, "ya^2");
  problem.cases = {{"light", 1, {{"ma", Expression(0.5)}}}, {"heavy", 1, {{"ma", Expression(2.0)}}}};
  CHECK(unused(problem) == Paths{});
  problem.design.emplace();
  problem.design->minimize = "psi0", problem.design->variables = {"ma"};
  CHECK(find_idle_variables(problem).size() == 1);
}

TEST_CASE("gravity and initial conditions count", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"g", 9.81});
  problem.scene.parameters.push_back({"y0", 0.1});
  problem.scene.gravity[1] = Expression::parse("-g");
  problem.scene.conditions.push_back({"yb", Expression::parse("y0"), {}});
  add_objective(problem, "ya");
  CHECK(unused(problem) == Paths{"parameters.mb", "parameters.y0"});
  add_objective(problem, "yb");
  CHECK(unused(problem) == Paths{});
}

TEST_CASE("channels of an identification look at their sensors", "[unused]") {
  Problem problem = two_pendulums();
  problem.scene.parameters.push_back({"gain", 1.0});
  ExperimentSpec experiment;
  experiment.name = "run";
  experiment.channels.push_back({"theta", "ya", "", false, 1.0, Expression::parse("gain"), 0.0});
  problem.identification.emplace();
  problem.identification->experiments.push_back(experiment);
  problem.identification->variables = {"ma"};
  CHECK(unused(problem) == Paths{"parameters.mb"});
}

TEST_CASE("the effort of a drive looks at what the drive moves", "[unused]") {
  Problem problem = two_pendulums();
  Drive drive;
  drive.name = "motor", drive.type = "angle", drive.joint = "A", drive.law = Expression::parse("t");
  problem.scene.drives.push_back(drive);
  Sensor effort;
  effort.name = "torque", effort.quantity = "drive_force", effort.drive = "motor";
  problem.scene.sensors.push_back(effort);
  add_objective(problem, "torque^2");
  CHECK(unused(problem) == Paths{"parameters.mb"});
}
