#include "core/scene/issues.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>
#include <memory>
#include <set>

#include "core/scene/scene_facts.hpp"
#include "core/scene/type_table.hpp"

using namespace mbsopt;

namespace {

Scene hinged_rod() {
  Scene scene;
  scene.parameters.push_back({"m", 2.0});
  scene.definitions.push_back({"half", Expression::parse("m/2")});
  Body body;
  body.name = "bob";
  body.mass = Expression::parse("m");
  body.inertia = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  body.points["tip"] = {1.0, 0.0, 0.0};
  scene.bodies.push_back(body);
  Joint joint;
  joint.name = "pin";
  joint.type = "revolute";
  joint.body2 = "bob";
  joint.axis1 = joint.axis2 = VectorField{0.0, 0.0, 1.0};
  scene.joints.push_back(joint);
  Sensor sensor;
  sensor.name = "theta";
  sensor.quantity = "angle";
  sensor.joint = "pin";
  scene.sensors.push_back(sensor);
  return scene;
}

// The messages at a path.
std::string at(const Scene& scene, const std::string& path) {
  std::string all;
  for (const SceneIssue& issue : find_issues(scene))
    if (issue.path == path) all += issue.message + "\n";
  return all;
}

Force spring() {
  Tsda tsda;
  tsda.body2 = "bob";
  tsda.point2 = "tip";
  tsda.stiffness = 100.0;
  return {"spring", tsda};
}

}  // namespace

TEST_CASE("a right scene has no issues", "[scene]") {
  Scene scene = hinged_rod();
  scene.forces.push_back(spring());
  scene.conditions.push_back({"theta", Expression::parse("30 [deg]"), Expression(0.0)});
  for (const SceneIssue& issue : find_issues(scene)) FAIL(issue.path << ": " << issue.message);
}

TEST_CASE("forces written with sensors and a force sensor are right; of other forces it is refused", "[scene]") {
  Scene scene = hinged_rod();
  scene.forces.push_back(spring());
  Torque servo;
  servo.body = "bob", servo.components[2] = Expression::parse("-m*theta + sin(t)");
  scene.forces.push_back({"servo", servo});
  Sensor pull;
  pull.name = "pull", pull.quantity = "force", pull.force = "spring";
  scene.sensors.push_back(pull);
  for (const SceneIssue& issue : find_issues(scene)) FAIL(issue.path << ": " << issue.message);
  scene.sensors.back().force = "servo";
  CHECK_THAT(at(scene, "sensors.pull.force"), Catch::Contains("'servo' is a torque"));
}

TEST_CASE("an empty scene needs a body", "[scene]") {
  CHECK_THAT(at(Scene(), "bodies"), Catch::Contains("at least one body"));
}

TEST_CASE("a joint of a scene made in C++ lacks or has too many axes", "[scene]") {
  Scene scene = hinged_rod();
  scene.joints[0].axis2.reset();
  CHECK_THAT(at(scene, "joints[0].axis2"), Catch::Contains("is missing"));
  scene = hinged_rod();
  scene.joints[0].type = "spherical";
  scene.sensors.clear();
  CHECK_THAT(at(scene, "joints[0].axis1"), Catch::Contains("this type does not have it"));
}

TEST_CASE("numbers of a scene made in C++ must be finite", "[scene]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Scene scene = hinged_rod();
  scene.bodies[0].position[1] = nan;
  scene.parameters[0].value = std::numeric_limits<double>::infinity();
  scene.simulation.end_time = nan;
  CHECK_THAT(at(scene, "bodies[0].position[1]"), Catch::Contains("must be finite"));
  CHECK_THAT(at(scene, "parameters.m.value"), Catch::Contains("must be finite"));
  CHECK_THAT(at(scene, "bodies[0].mass"), Catch::Contains("must be finite"));
  CHECK_THAT(at(scene, "simulation.end_time"), Catch::Contains("must be finite"));
}

TEST_CASE("inertia tensors at the edge of what a body can have", "[scene]") {
  const auto problem = [](InertiaField inertia) {
    Scene scene = hinged_rod();
    scene.bodies[0].inertia = inertia;
    return at(scene, "bodies[0].inertia");
  };
  CHECK(problem({0.0, 0.0, 0.0, 0.0, 0.0, 0.0}).empty());              // point mass
  CHECK(problem({0.0, 1.0 / 12, 1.0 / 12, 0.0, 0.0, 0.0}).empty());    // thin rod
  CHECK(problem({0.0, 0.0833333, 0.0833333, 0.0, 0.0, 0.0}).empty());  // written with six digits
  CHECK(problem({1.0, 2.0, 3.0, 0.0, 0.0, 0.0}).empty());              // lamina
  CHECK(problem({1e-30, 1e-30, 2e-30, 0.0, 0.0, 0.0}).empty());
  CHECK(problem({2.0, 2.0, 2.0, 0.5, -0.5, 0.5}).empty());
  CHECK_THAT(problem({1.0, 2.0, 3.01, 0.0, 0.0, 0.0}), Catch::Contains("must not exceed the sum of the other two"));
  CHECK_THAT(problem({0.0, 0.0, 1.0, 0.0, 0.0, 0.0}), Catch::Contains("[J/2, J/2, J]"));
  CHECK_THAT(problem({1.0, 1.0, 1.0, 1.1, 0.0, 0.0}), Catch::Contains("positive semidefinite"));
  CHECK_THAT(problem({-1e-30, 1e-30, 1e-30, 0.0, 0.0, 0.0}), Catch::Contains("positive semidefinite"));
}

TEST_CASE("normals come in pairs and not along the axis", "[scene]") {
  Scene scene = hinged_rod();
  scene.joints[0].normal1 = VectorField{1.0, 0.0, 0.0};
  CHECK_THAT(at(scene, "joints[0].normal2"), Catch::Contains("give both normals"));
  scene.joints[0].normal2 = VectorField{0.0, 0.0, -2.0};
  CHECK_THAT(at(scene, "joints[0].normal2"), Catch::Contains("parallel to the axis"));
}

TEST_CASE("an angle between different axes needs normals only where it is used", "[scene]") {
  Scene scene = hinged_rod();
  scene.joints[0].axis2 = VectorField{0.0, 1.0, 0.0};
  CHECK_THAT(at(scene, "joints[0]"), Catch::Contains("give normal1 and normal2"));
  scene.sensors.clear();
  CHECK(at(scene, "joints[0]").empty());
}

TEST_CASE("conditions fit what their sensor measures", "[scene]") {
  Scene scene = hinged_rod();
  scene.sensors[0].quantity = "rate";
  scene.conditions.push_back({"theta", Expression(1.0), Expression(1.0)});
  CHECK_THAT(at(scene, "initial.conditions[0].rate"), Catch::Contains("give its \"value\""));
  scene = hinged_rod();
  scene.conditions.push_back({"theta", {}, {}});
  CHECK_THAT(at(scene, "initial.conditions[0]"), Catch::Contains("neither"));
  scene.conditions[0].value = Expression::parse("1 [m]");
  CHECK_THAT(at(scene, "initial.conditions[0].value"), Catch::Contains("expected is rad"));
  Sensor energy;
  energy.name = "E";
  energy.quantity = "energy";
  energy.component = "total";
  scene.sensors.push_back(energy);
  scene.conditions[0] = {"E", Expression(1.0), {}};
  CHECK_THAT(at(scene, "initial.conditions[0].sensor"), Catch::Contains("cannot prescribe"));
}

TEST_CASE("laws use their own names and the parameters", "[scene]") {
  Scene scene = hinged_rod();
  Force force = spring();
  std::get<Tsda>(force.kind).stiffness = 0.0;
  std::get<Tsda>(force.kind).law = Expression::parse("100*(l - half) + 5*ldot + sin(t)");
  scene.forces.push_back(force);
  CHECK(find_issues(scene).empty());
  std::get<Tsda>(scene.forces[0].kind).law = Expression::parse("angle + theta");
  CHECK_THAT(at(scene, "forces[0].law"),
             Catch::Contains("unknown name 'angle'") && Catch::Contains("unknown name 'theta'"));
  std::get<Tsda>(scene.forces[0].kind).law = Expression::parse("1 [kg]");
  CHECK_THAT(at(scene, "forces[0].law"), Catch::Contains("expected is N"));
}

TEST_CASE("a law beside coefficients is a warning", "[scene]") {
  Scene scene = hinged_rod();
  Force force = spring();
  std::get<Tsda>(force.kind).law = Expression::parse("l");
  scene.forces.push_back(force);
  const std::vector<SceneIssue> issues = find_issues(scene);
  REQUIRE(issues.size() == 1);
  CHECK(issues[0].is_warning);
  CHECK(issues[0].path == "forces[0].law");
  CHECK_THAT(issues[0].message, Catch::Contains("stiffness"));
}

TEST_CASE("a reaction is that of any joint with bodies, whether it has an angle or not", "[scene]") {
  Scene scene = hinged_rod();
  scene.sensors[0].quantity = "reaction", scene.sensors[0].kind = "force", scene.sensors[0].component = "x";
  for (const TypeRow& row : kJointTypes) {
    scene.joints[0].type = row.name;
    const std::string found = at(scene, "sensors.theta.joint");
    INFO(row.name << ": " << found);
    CHECK(found.empty() != ties_joints(scene.joints[0]));
  }
}

TEST_CASE("circular and endless definitions are reported once, at the definition", "[scene]") {
  Scene scene = hinged_rod();
  scene.definitions = {{"a", Expression::parse("b + 1")},
                       {"b", Expression::parse("a + 1")},
                       {"c", Expression::parse("a*2")},
                       {"half", Expression::parse("1")}};
  scene.bodies[0].mass = Expression::parse("c");
  std::vector<std::string> paths;
  for (const SceneIssue& issue : find_issues(scene)) paths.push_back(issue.path);
  CHECK(paths == std::vector<std::string>{"definitions.a", "definitions.b"});

  scene.definitions.assign(1, {"d0", Expression(1.0)});
  for (int i = 1; i < 2000; ++i)
    scene.definitions.push_back({"d" + std::to_string(i), Expression::parse("d" + std::to_string(i - 1))});
  scene.bodies[0].mass = Expression::parse("d1999");
  const std::vector<SceneIssue> issues = find_issues(scene);
  REQUIRE(issues.size() == 1);
  CHECK_THAT(issues[0].message, Catch::Contains("nest deeper"));
}

TEST_CASE("definitions between two circles belong to neither", "[scene]") {
  Scene scene = hinged_rod();
  scene.definitions = {{"a", Expression::parse("b")},       {"b", Expression::parse("a + between")},
                       {"between", Expression::parse("c")}, {"c", Expression::parse("d")},
                       {"d", Expression::parse("c*2")},     {"half", Expression::parse("half + 1")}};
  std::set<std::string> paths;
  for (const SceneIssue& issue : find_issues(scene)) paths.insert(issue.path);
  CHECK(paths ==
        std::set<std::string>{"definitions.a", "definitions.b", "definitions.c", "definitions.d", "definitions.half"});
}

TEST_CASE("definitions have their values wherever they are used, in any order", "[scene]") {
  Scene scene = hinged_rod();
  scene.definitions = {{"third", Expression::parse("second + m")},
                       {"second", Expression::parse("3*half")},
                       {"half", Expression::parse("m/2")}};
  const SceneFacts facts(scene);
  CHECK(facts.value(Expression::parse("2*third + m")).value() == 12);
  CHECK_FALSE(facts.value(Expression::parse("2*fourth")));
}

TEST_CASE("twenty thousand definitions are checked in time that grows as their number", "[scene]") {
  for (const bool reverse : {false, true}) {
    Scene scene = hinged_rod();
    const int n = 20'000;
    for (int i = 0; i < n; ++i)
      scene.definitions.push_back(
          {"d" + std::to_string(i), Expression::parse("d" + std::to_string(reverse ? i + 1 : i - 1))});
    scene.definitions[reverse ? n : 1].value = Expression(1.0);
    const std::vector<SceneIssue> issues = find_issues(scene);  // minutes if each looked at all others
    REQUIRE_FALSE(issues.empty());
    CHECK_THAT(issues.back().message, Catch::Contains("nest deeper"));
  }
}

TEST_CASE("angles beyond a turn and rates that are round in degrees are asked about", "[scene]") {
  Scene scene = hinged_rod();
  scene.parameters.push_back({"theta0", 75.0});
  const auto asked = [&](const Expression& value, const Expression& rate) {
    scene.conditions = {{"theta", value, rate}};
    return at(scene, "initial.conditions[0].value") + at(scene, "initial.conditions[0].rate");
  };
  CHECK_THAT(asked(Expression::parse("-35"), Expression(0.0)),
             Catch::Contains("'-35' is -35 rad: are degrees meant?") && Catch::Contains("\"-35 [deg]\""));
  CHECK_THAT(asked(Expression::parse("theta0"), Expression(0.0)), Catch::Contains("is 75 rad"));
  CHECK_THAT(asked(Expression(0.0), Expression(-270.0)), Catch::Contains("-270 rad/s"));
  for (const char* meant : {"6.28", "-3", "75 [rad]", "75 [deg]", "12*pi"})
    CHECK(asked(Expression::parse(meant), Expression(0.0)).empty());
  for (const char* meant : {"314", "100", "450", "60", "2*pi*45", "360 [deg/s]"})
    CHECK(asked(Expression(0.0), Expression::parse(meant)).empty());
  scene.parameters.back().unit = "rad";
  CHECK(asked(Expression::parse("theta0"), Expression(0.0)).empty());
}

TEST_CASE("the law of a drive in degrees is asked about", "[scene]") {
  Scene scene = hinged_rod();
  const auto asked = [&](const char* law) {
    scene.drives = {{"turn", "angle", "", "", "pin", "ground", "", "O", "O", Expression::parse(law), {}}};
    return at(scene, "drives[0].law");
  };
  CHECK_THAT(asked("0.2 - 180*t"), Catch::Contains("-180 rad/s at the start"));
  CHECK_THAT(asked("45 + t"), Catch::Contains("45 rad at the start"));
  for (const char* meant : {"0.3 + 6*t", "2*pi*30*t", "314*t", "180 [deg/s]*t", "sin(6*t)"})
    CHECK(asked(meant).empty());
}

TEST_CASE("a radius of gyration out of all proportion is asked about", "[scene]") {
  Scene scene = hinged_rod();
  scene.bodies[0].inertia = {700.0, 700.0, 700.0, 0.0, 0.0, 0.0};  // of a radius of 18.7 m, in 1 m
  CHECK(at(scene, "bodies[0].inertia").empty());
  scene.bodies[0].inertia = {7000.0, 7000.0, 7000.0, 0.0, 0.0, 0.0};
  CHECK_THAT(at(scene, "bodies[0].inertia"), Catch::Contains("[kg mm^2]"));
  scene.bodies.push_back(scene.bodies[0]);  // as a nearly massless rotor
  scene.bodies[1].name = "heavy", scene.bodies[1].mass = 1e4;
  CHECK(at(scene, "bodies[0].inertia").empty());
}

TEST_CASE("samples of a drive are in its unit, and an angle goes on over turns", "[scene]") {
  Scene scene = hinged_rod();
  const auto issue = [&](const std::string& unit, std::vector<double> values, const char* type) {
    SampledLaw law;
    law.column = "x", law.unit = unit;
    std::vector<double> t(values.size());
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = 0.25 * static_cast<double>(i);
    law.curve = std::make_shared<const Curve>(Interpolation::spline, t, std::move(values));
    scene.joints[0].type = "cylindrical";
    scene.drives = {{"turn", type, "", "", "pin", "ground", "", "O", "O", Expression(0.0), law}};
    return at(scene, "drives[0].law.column");
  };
  const std::vector<double> smooth{0, 0.5, 1, 1.5, 2, 2.5}, wrapped{2, 2.5, 3, -2.8, -2.3, -1.8};
  CHECK(issue("rad", smooth, "angle").empty());
  CHECK(issue("", smooth, "angle").empty());
  CHECK_THAT(issue("m", smooth, "angle"), Catch::Contains("'x' is in m; expected is rad"));
  CHECK_THAT(issue("kg", smooth, "displacement"), Catch::Contains("expected is m"));
  CHECK_THAT(issue("rad/s", smooth, "angle"), Catch::Contains("expected is rad"));
  CHECK_THAT(issue("rad", smooth, "displacement"), Catch::Contains("is in rad; expected is m"));
  CHECK_THAT(issue("rad", wrapped, "angle"), Catch::Contains("jumps from 3 to -2.8 at 0.75 s, by about a turn"));
  CHECK(issue("m", wrapped, "displacement").empty());
  CHECK_THAT(issue("", {340, 350, 1, 11, 21, 30}, "angle"), Catch::Contains("in degrees"));
  // With few samples per turn a wrap is shorter than a turn by the step of the motion.
  CHECK_THAT(issue("", {20, 100, 180, 260, 340, 60, 140}, "angle"), Catch::Contains("jumps from 340 to 60"));
  CHECK_THAT(issue("rad", {5.5, 4.1, 2.7, 1.3, 6.18, 4.78, 3.38}, "angle"), Catch::Contains("jumps from 1.3 to 6.18"));
  CHECK(issue("rad", {0, 1.4, 2.8, 4.2, 2.8, 1.4, 0}, "angle").empty());
}

TEST_CASE("a signal that a drive follows as an angle goes on over turns", "[scene]") {
  Scene scene = hinged_rod();
  Signal signal;
  signal.name = "encoder", signal.column = "enc", signal.interpolation = Interpolation::spline;
  const std::vector<double> t{0, 0.1, 0.2, 0.3, 0.4, 0.5}, y{4, 5, 6, 0.717, 1.717, 2.717};
  signal.curve = std::make_shared<const Curve>(Interpolation::spline, t, y);
  scene.signals = {signal};
  scene.joints[0].type = "cylindrical";
  scene.drives = {{"turn", "angle", "", "", "pin", "ground", "", "O", "O", Expression::parse("0.2 + encoder"), {}}};
  CHECK_THAT(at(scene, "drives[0].law"), Catch::Contains("'enc' jumps from 6 to 0.717 at 0.3 s"));
  scene.drives[0].type = "displacement";
  CHECK(at(scene, "drives[0].law").empty());
}

TEST_CASE("sensors that are expressions are checked", "[scene]") {
  Scene scene = hinged_rod();
  const auto add = [&](const std::string& name, const std::string& value) {
    Sensor s;
    s.name = name, s.quantity = "expression", s.value = Expression::parse(value);
    scene.sensors.push_back(s);
  };
  add("twice", "theta + theta");
  scene.conditions = {{"twice", Expression::parse("30 [deg]"), {}}};
  CHECK(find_issues(scene).empty());
  CHECK(unit_of(scene, scene.sensors.back()) == "rad");

  SECTION("circles") {
    add("a", "b + theta");
    add("b", "2*a");
    add("c", "a");
    CHECK_THAT(at(scene, "sensors.a.value"), Catch::Contains("'a' refers to itself"));
    CHECK_THAT(at(scene, "sensors.b.value"), Catch::Contains("'b' refers to itself"));
    CHECK(at(scene, "sensors.c.value").empty());
  }
  SECTION("unknown names") {
    add("a", "2*thetta");
    add("b", "a");
    CHECK_THAT(at(scene, "sensors.a.value"), Catch::Contains("unknown name 'thetta' (did you mean 'theta'"));
    CHECK(find_issues(scene).size() == 1);
  }
  SECTION("units") {
    add("mean", "(theta + twice)/2");
    add("odd", "theta + 3 [m]");
    CHECK(unit_of(scene, scene.sensors[scene.sensors.size() - 2]) == "rad");
    CHECK_THAT(at(scene, "sensors.odd.value"), Catch::Contains("combines rad with m"));
    scene.conditions[0].value = Expression::parse("3 [m]");
    CHECK_THAT(at(scene, "initial.conditions[0].value"), Catch::Contains("has the dimension m, expected is rad"));
  }
  SECTION("conditions and forces") {
    Sensor rate = scene.sensors[0];
    rate.name = "omega", rate.quantity = "rate";
    Sensor acceleration;
    acceleration.name = "a", acceleration.quantity = "acceleration", acceleration.body = scene.bodies[0].name;
    acceleration.component = "x";
    scene.sensors.insert(scene.sensors.end(), {rate, acceleration});
    add("fast", "omega^2");
    add("late", "theta*t");
    add("hard", "a*theta");
    for (const char* name : {"fast", "late", "hard"}) {
      scene.conditions[0].sensor = name;
      CHECK_THAT(at(scene, "initial.conditions[0].sensor"), Catch::Contains("an expression of more than positions"));
    }
    scene.conditions.clear();
    Torque torque;
    torque.body = scene.bodies[0].name;
    torque.components = {0.0, Expression::parse("fast + late"), Expression::parse("hard")};
    scene.forces.push_back({"motor", torque});
    const std::string path = "forces[" + std::to_string(scene.forces.size() - 1) + "].components";
    CHECK(at(scene, path + "[1]").empty());
    CHECK_THAT(at(scene, path + "[2]"), Catch::Contains("a force cannot depend on it"));
  }
}

TEST_CASE("dimensions follow through parameters and definitions", "[scene]") {
  Scene scene = hinged_rod();
  scene.parameters.push_back({"L", 1.0, {}, {}, ParameterScale::linear, "m"});
  scene.parameters.push_back({"w", 0.1, {}, {}, ParameterScale::linear, "m"});
  scene.definitions.push_back({"volume", Expression::parse("L*w^2")});
  scene.bodies[0].mass = Expression::parse("volume");
  CHECK_THAT(at(scene, "bodies[0].mass"), Catch::Contains("has the dimension m^3, expected is kg"));
  scene.bodies[0].mass = Expression::parse("7850*volume");  // a plain number may stand for anything
  CHECK(at(scene, "bodies[0].mass").empty());
  scene.bodies[0].mass = Expression::parse("7850 [kg/m^2]*volume");
  CHECK_THAT(at(scene, "bodies[0].mass"), Catch::Contains("has the dimension kg m, expected is kg"));
  scene.definitions.push_back({"length", Expression::parse("sqrt(0.5^2 + 1)")});
  scene.bodies[0].mass = Expression::parse("7850 [kg/m^2]*L*length");
  CHECK(at(scene, "bodies[0].mass").empty());
  scene.bodies[0].mass = Expression::parse("7850 [kg/m^3]*volume");
  scene.bodies[0].points["tip"] = {Expression::parse("-L/2"), Expression::parse("w + 1 [mm]"), 0.0};
  CHECK(find_issues(scene).empty());
  scene.bodies[0].points["tip"][1] = Expression::parse("w*L");
  CHECK_THAT(at(scene, "bodies[0].points.tip[1]"), Catch::Contains("has the dimension m^2"));
  scene.bodies[0].points["tip"][1] = 0.0;
  scene.definitions.push_back({"sum", Expression::parse("L + w^2")});
  scene.bodies[0].mass = Expression::parse("sum");  // wrong once, at its definition
  CHECK_THAT(at(scene, "definitions.sum"), Catch::Contains("combines m with m^2"));
  CHECK(find_issues(scene).size() == 1);
}

TEST_CASE("thousands of bodies are checked", "[scene]") {
  Scene scene = hinged_rod();
  const Body body = scene.bodies[0];
  const Joint joint = scene.joints[0];
  for (int i = 1; i < 3000; ++i) {
    scene.bodies.push_back(body);
    scene.bodies.back().name = "b" + std::to_string(i);
    scene.joints.push_back(joint);
    scene.joints.back().name = "j" + std::to_string(i);
    scene.joints.back().body2 = scene.bodies.back().name;
  }
  CHECK(find_issues(scene).empty());
}

TEST_CASE("names show as they are written, and are short enough for a file", "[scene]") {
  const auto finding = [](const std::string& name) {
    Scene scene = hinged_rod();
    scene.name = scene.bodies[0].name = scene.joints[0].name = name;
    scene.joints[0].body2 = name, scene.sensors[0].joint = name;
    const std::string found = at(scene, "bodies[0].name");
    CHECK(at(scene, "joints[0].name") == found);
    CHECK(at(scene, "name") == found);
    return found;
  };
  for (const std::string good : {"left rod", "Stange_\xC3\xA4", "\xE6\x9D\x86", "\xE2\x80\x9Ctip\xE2\x80\x9D", "=1+1"})
    CHECK(finding(good) == "");
  for (const std::string bad : {"a\x1B(B", "a\nb", "a\x7F", "a\xC2\x9B",
                                "a\xE2\x80\xAE"
                                "b",
                                "a\xE2\x81\xA6"
                                "b",
                                "a\xE2\x80\x8F"
                                "b",
                                "a\xD8\x9C"
                                "b",
                                "a\xE2\x80\xA8"
                                "b"}) {
    INFO(bad);
    CHECK_THAT(finding(bad), Catch::Contains("control character or a mark of text direction at byte 2"));
  }
  CHECK(finding(std::string(255, 'a')) == "");
  CHECK_THAT(finding(std::string(256, 'a')), Catch::Contains("256 bytes long, at most 255"));
  Scene scene = hinged_rod();
  scene.parameters[0].name = std::string(300, 'm');
  CHECK_THAT(at(scene, "parameters." + scene.parameters[0].name), Catch::Contains("at most 255"));
}
