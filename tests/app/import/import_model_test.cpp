#include "app/import/import_model.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "app/json/input_error.hpp"
#include "app/json/read_problem.hpp"
#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "optim/problem/parameter_values.hpp"
#include "source_folder.hpp"
#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;
using Catch::Contains;
using Eigen::Vector3d;

namespace {

std::filesystem::path example(const char* name) {
  return std::filesystem::path(MBSOPT_SOURCE_DIR) / "examples" / "models" / name;
}

ImportedProblem imported_text(const std::string& text) {
  const TemporaryFolder folder;
  return import_model(folder.write("model.xml", text));
}

Problem tight(const ImportedProblem& imported, std::vector<std::string> sets = {}) {
  sets.emplace_back(R"(simulation.integrator={"type": "dopri853", "rtol": 1e-11, "atol": 1e-12})");
  return read_problem_text(imported.text, "imported.json", sets);
}

struct End {
  std::vector<Vector3d> origins;  // of the bodies' frames [m]
  std::vector<double> sensors;
  double energy_drift = 0;
  int degrees_of_freedom = 0;
};

End at_the_end(const Problem& problem) {
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  End end;
  Sampling last;
  last.times = {problem.scene.simulation.end_time};
  last.observe = [&](std::size_t, const StatePoint& at) {
    for (int i = 0; i < mechanism.bodies(); ++i) end.origins.push_back(body_row(mechanism, i, at).head<3>());
    for (int i = 0; i < mechanism.sensors(); ++i) end.sensors.push_back(mechanism.sensor_value(i, at));
  };
  const SimulationResult result = simulate(mechanism, problem.scene.simulation, {}, last);
  INFO(result.message);
  REQUIRE(result.ok());
  end.energy_drift = result.statistics.energy_drift;
  end.degrees_of_freedom = Assembly(mechanism, 0).summary().degrees_of_freedom;
  return end;
}

std::string conditions(const std::vector<std::pair<std::string, double>>& rates) {
  std::string list;
  for (const auto& [sensor, rate] : rates)
    list += (list.empty() ? "" : ",") + (R"({"sensor": ")" + sensor + R"(", "value": 0, "rate": )") +
            std::to_string(rate) + "}";
  return R"(initial={"conditions": [)" + list + "]}";
}

std::string components(const char* path, const Vector3d& v) {
  std::ostringstream text;
  text.precision(17);
  text << path << "=[" << v(0) << "," << v(1) << "," << v(2) << "]";
  return text.str();
}

std::string finding_of(const std::string& text) {
  try {
    imported_text(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

// A body that turns about a joint; `inertial` and `joint` as in the file.
std::string robot(const std::string& inside) {
  return "<robot name=\"r\">\n<link name=\"base\"/>\n" + inside + "\n</robot>";
}
const std::string kMass =
    R"(<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>)";
std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& more = "", const std::string& type = "continuous") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + more + "</joint>\n";
}
std::string link(const std::string& name) { return "<link name=\"" + name + "\">" + kMass + "</link>\n"; }

}  // namespace

// The references are MuJoCo 2.2.2's: mj_loadXML of the same file, contacts and limits disabled, RK4. Steps of 1e-4 s
// and 2e-5 s agree to 1e-10. MuJoCo diagonalises inertias to about 1e-9.
TEST_CASE("a URDF arm moves as in MuJoCo", "[import]") {
  const Problem problem =
      tight(import_model(example("arm.urdf")), {conditions({{"shoulder", 1.5}, {"slider", 0.2}, {"elbow", -2}})});
  const End end = at_the_end(problem);
  REQUIRE(problem.scene.bodies.size() == 3);  // the tool is a part of the forearm
  CHECK((end.origins[1] - Vector3d(-0.631063687475, 0.962093180035, -2.268372017729)).norm() < 1e-8);
  CHECK((end.origins[2] - Vector3d(-0.719019137124, 0.934671447269, -2.375665481878)).norm() < 1e-8);
  CHECK(end.sensors[0] == Approx(1.30294099203).margin(1e-8));
  CHECK(end.sensors[1] == Approx(2.86837072056).margin(1e-8));
  CHECK(end.sensors[2] == Approx(-0.692630464209).margin(1e-8));
}

TEST_CASE("an MJCF hopper of classes, geoms, springs and turned frames moves as in MuJoCo", "[import]") {
  const Problem problem = tight(import_model(example("hopper.xml")),
                                {conditions({{"rootx", 0.5}, {"rootz", 0}, {"rooty", 1}, {"hip", -1}, {"knee", 0.5}})});
  const End end = at_the_end(problem);
  REQUIRE(problem.scene.bodies.size() == 5);  // two without mass carry the root's three joints
  CHECK(problem.scene.bodies[2].mass.number() == Approx(3.506491253).epsilon(1e-9));
  CHECK((end.origins[2] - Vector3d(0.434748354544, 0.076657864725, 0.232335577720)).norm() < 1e-10);
  CHECK((end.origins[3] - Vector3d(0.458318654082, 0.080730127263, 0.032808068130)).norm() < 1e-10);
  CHECK((end.origins[4] - Vector3d(0.546407847540, 0.203123239129, -0.359187110620)).norm() < 1e-10);
  CHECK(end.sensors[3] == Approx(-0.253232976337).margin(1e-10));
}

TEST_CASE("a free MJCF body with a damped ball joint moves as in MuJoCo", "[import]") {
  const Vector3d omega(0.5, 1, -0.5), v(0.1, 0, 0.2);
  const Eigen::Matrix3d mast = (Eigen::AngleAxisd(0.3, Vector3d::UnitX()) * Eigen::AngleAxisd(0.2, Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-0.1, Vector3d::UnitZ()))
                                   .toRotationMatrix();
  const Problem problem = tight(import_model(example("satellite.xml")),
                                {components("bodies[0].velocity", v), components("bodies[0].angular_velocity", omega),
                                 components("bodies[1].velocity", v + omega.cross(Vector3d(0.5, 0, 0))),
                                 components("bodies[1].angular_velocity", omega + mast * Vector3d(1, -0.4, 0.3))});
  const End end = at_the_end(problem);
  CHECK((end.origins[0] - Vector3d(0.460961291809, -0.069562424887, 0.211239863394)).norm() < 1e-8);
  CHECK((end.origins[1] - Vector3d(0.694048331330, -0.317301189676, -0.155224236387)).norm() < 1e-8);
}

TEST_CASE("what an import changes and drops is said with its line", "[import]") {
  const ImportedProblem arm = import_model(example("arm.urdf"));
  CHECK(arm.changed ==
        std::vector<std::string>{"link 'tool' is a part of 'fore'", "the root link 'base' is fixed to the ground"});
  CHECK(arm.dropped == std::vector<std::string>{"line 11: limit (may change the motion)",
                                                "line 40: collision (may change the motion)", "line 51: transmission"});
  CHECK_THAT(arm.text, Contains("// Imported from arm.urdf") && Contains("//   line 51: transmission"));
  const ImportedProblem hopper = import_model(example("hopper.xml"));
  CHECK_THAT(hopper.text, Contains("line 35: actuator") && Contains("line 8: joint range (may change the motion)"));
}

TEST_CASE("a mimicking URDF joint becomes a gear", "[import]") {
  const ImportedProblem imported = imported_text(
      robot(link("a") + link("b") + joint("j1", "base", "a", R"(<origin xyz="0 0 1"/><axis xyz="0 1 0"/>)") +
            joint("j2", "a", "b", R"(<axis xyz="0 1 0"/><mimic joint="j1" multiplier="-2"/>)")));
  const End end = at_the_end(tight(imported, {conditions({{"j1", 1}})}));
  CHECK(end.degrees_of_freedom == 1);
  CHECK(end.sensors[0] > 0.5);
  CHECK(end.sensors[1] == Approx(-2 * end.sensors[0]).epsilon(1e-9));
}

TEST_CASE("an MJCF loop that a connect closes keeps its energy", "[import]") {
  const ImportedProblem imported = imported_text(R"(<mujoco model="four-bar">
  <compiler angle="radian"/>
  <default><geom type="capsule" size="0.02"/><joint axis="0 1 0"/></default>
  <worldbody>
    <body name="crank"><joint name="A"/><geom fromto="0 0 0 0 0 0.3"/>
      <body name="coupler" pos="0 0 0.3"><joint name="B"/><geom fromto="0 0 0 1 0 0.3"/></body></body>
    <body name="rocker" pos="1 0 0"><joint name="D"/><geom fromto="0 0 0 0 0 0.6"/></body>
  </worldbody>
  <equality><connect name="C" body1="coupler" body2="rocker" anchor="1 0 0.3"/></equality>
</mujoco>)");
  const End end = at_the_end(tight(imported, {R"(initial={"conditions": [{"sensor": "A", "value": 0, "rate": 3}]})"}));
  CHECK(end.degrees_of_freedom == 1);
  CHECK(end.energy_drift < 1e-8);  // of 10 J
  CHECK(std::abs(end.sensors[0]) > 0.5);
}

TEST_CASE("MJCF joints that an equality ties and bodies that one welds stay so", "[import]") {
  const ImportedProblem imported = imported_text(R"(<mujoco model="rack">
  <worldbody>
    <body name="pinion"><joint name="turn" axis="0 1 0" frictionloss="0.1"/><geom size="0.1" pos="0.1 0 0"/></body>
    <frame pos="0 0 1" euler="0 0 90">
      <body name="rack"><joint name="push" type="slide" axis="0 1 0"/><geom size="0.1"/></body>
      <body name="load" pos="0 0.5 0"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body>
    </frame>
  </worldbody>
  <equality>
    <joint joint1="push" joint2="turn" polycoef="0 0.2 0 0 0"/>
    <weld body1="rack" body2="load"/>
    <weld body1="pinion" active="false"/>
  </equality>
</mujoco>)");
  CHECK_THAT(imported.text, Contains("weld is not active") && Contains("dry friction does not stick"));
  const Problem problem = tight(imported, {R"(initial={"conditions": [{"sensor": "turn", "value": 0, "rate": 2}]})"});
  const End end = at_the_end(problem);
  CHECK(end.degrees_of_freedom == 1);
  CHECK(std::abs(end.sensors[0]) > 0.1);
  CHECK(end.sensors[1] == Approx(0.2 * end.sensors[0]).epsilon(1e-9));
  // The frame turns y of its bodies to -x.
  CHECK((end.origins[1] - Vector3d(-end.sensors[1], 0, 1)).norm() < 1e-9);
  CHECK((end.origins[2] - end.origins[1] - Vector3d(-0.5, 0, 0)).norm() < 1e-9);
}

TEST_CASE("names become those of a problem file", "[import]") {
  const ImportedProblem imported =
      imported_text(robot("<link name=\"a/b.c\">" + kMass + "</link>" + joint("t", "base", "a/b.c") + link("a_b_c") +
                          joint("sin", "base", "a_b_c")));
  const Problem problem = tight(imported);
  CHECK(problem.scene.bodies[0].name == "a_b_c");
  CHECK(problem.scene.bodies[1].name == "a_b_c_2");
  CHECK(problem.scene.sensors[0].name == "t_2");  // t is the time, sin a function
  CHECK(problem.scene.sensors[1].name == "sin_2");
}

TEST_CASE("a broken model is refused with its line", "[import]") {
  CHECK_THAT(finding_of("<robot>\n<link name=\"a\">\n</robot>"), Contains("model.xml:3:") && Contains("is no XML"));
  CHECK_THAT(finding_of(""), Contains("is no XML"));
  CHECK_THAT(finding_of("<sdf/>"), Contains("<robot>") && Contains("<mujoco>"));
  CHECK_THAT(finding_of("<robot name='a' name='b'/>"), Contains("twice"));
  std::string deep;
  for (int i = 0; i < 3000; ++i) deep += "<a>";
  CHECK_THAT(finding_of(deep + "</a>"), Contains("is no XML"));
  std::string closed = deep;
  for (int i = 0; i < 3000; ++i) closed += "</a>";
  CHECK_THAT(finding_of(closed), Contains("nested more than 1000 deep"));
  CHECK_THAT(finding_of(robot("")), Contains("has no body that moves"));
  CHECK_THAT(finding_of(robot(link("a"))), Contains("model.xml:3:1: link 'a': is a second root"));
  CHECK_THAT(finding_of(robot(link("a") + joint("j", "base", "b"))), Contains("4:") && Contains("no link 'b'"));
  CHECK_THAT(finding_of(robot(link("a") + joint("j", "base", "a", "", "hinge"))), Contains("available: revolute"));
  CHECK_THAT(finding_of(robot(link("a") + joint("j", "base", "a", "<axis xyz=\"0 1\"/>"))),
             Contains("axis: xyz: has 2 numbers, must have 3"));
  CHECK_THAT(finding_of(robot(link("a") + joint("j", "base", "a", "<axis xyz=\"0 ${y} 1\"/>"))), Contains("xacro"));
  CHECK_THAT(finding_of(robot(link("a") + link("b") + joint("j", "a", "b") + joint("k", "b", "a"))),
             Contains("circle"));
  // What validate would refuse is said of the element.
  CHECK_THAT(finding_of(robot("<link name=\"a\">\n<inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" "
                              "iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>" +
                              joint("j", "base", "a"))),
             Contains("model.xml:3:1: link 'a': ") && Contains("inertia"));
  const auto mjcf = [](const std::string& inside) {
    return "<mujoco>\n<worldbody>" + inside + "</worldbody></mujoco>";
  };
  CHECK_THAT(finding_of(mjcf("<include file='x'/>")), Contains("2:12: include: is not read"));
  CHECK_THAT(finding_of(mjcf("<body name='a'><joint/><geom type='mesh' mesh='m'/></body>")), Contains("<inertial>"));
  CHECK_THAT(finding_of(mjcf("<body><joint type='screw'/><geom size='1'/></body>")), Contains("available: free"));
  CHECK_THAT(finding_of(mjcf("<body><joint class='x'/><geom size='1'/></body>")), Contains("no default class 'x'"));
  CHECK_THAT(finding_of(mjcf("<body><joint/><geom type='box' size='1 1'/></body>")), Contains("needs 3 numbers"));
  CHECK_THAT(finding_of(mjcf("<body><joint/><geom size='1e200'/></body>")),
             Contains("2:12: body: ") && Contains("too large for a number"));
  CHECK_THAT(finding_of(mjcf("<body><joint axis='0 0 0'/><geom size='1'/></body>")), Contains("axis: is zero"));
}

TEST_CASE("settotalmass counts neither geoms nor meshes of the world, as in MuJoCo", "[import]") {
  const ImportedProblem imported = imported_text(R"(<mujoco><compiler settotalmass="6"/><worldbody>
  <geom type="box" size="5 5 0.1"/><geom type="mesh" mesh="x"/>
  <body pos="0 0 3"><geom size="0.1" mass="3"/></body>
  <body><joint/><geom size="0.1" mass="1"/></body></worldbody></mujoco>)");
  CHECK(tight(imported).scene.bodies[0].mass.number() == Approx(1.5));  // MuJoCo 2.2.2: 4.5 kg on the fixed body
  CHECK(imported.dropped == std::vector<std::string>{"line 2: geom (may change the motion)"});
}

TEST_CASE("MJCF joints in a frame are placed by it", "[import]") {
  const auto body = [](const std::string& joints) {
    return imported_text("<mujoco><worldbody><body><joint axis='0 1 0'/><geom size='0.1'/><body pos='0 0 1'>" + joints +
                         "<geom size='0.1' pos='0.2 0 0'/></body></body></worldbody></mujoco>");
  };
  const std::string plain = body("<joint name='j' axis='1 0 0' pos='0 0 0.5'/><joint name='k' axis='0 0 1'/>").text;
  CHECK(body("<frame pos='0 0 0.5' euler='0 90 0'><joint name='j'/></frame><joint name='k' axis='0 0 1'/>").text ==
        plain);
  CHECK(body("<frame euler='30 0 0'><freejoint/></frame>").joints == 1);
  CHECK_THAT(finding_of("<mujoco><worldbody><body><joint/><frame><inertial mass='1' pos='0 0 0'/></frame></body>"
                        "</worldbody></mujoco>"),
             Contains("inertial: is in a <frame>"));
}

TEST_CASE("resistance of a joint that a problem file lacks is listed, also that of a class", "[import]") {
  const auto joints = [](const std::string& option) {
    return imported_text("<mujoco>" + option +
                         R"(<default><joint stiffness="7" frictionloss="0.3" damping="1"/></default>
<worldbody>
<body><joint type="ball"/><geom size="0.1" pos="0.2 0 0"/>
<body><joint name="h" axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/></body></body>
<body><joint type="free"/><geom size="0.1"/></body>
<body><freejoint/><geom size="0.1"/></body>
</worldbody></mujoco>)");
  };
  const ImportedProblem all = joints("");
  CHECK(all.changed ==
        std::vector<std::string>{"line 3: stiffness 7 of a ball joint is left out (may change the motion)",
                                 "line 3: frictionloss 0.3 of a ball joint is left out (may change the motion)",
                                 "line 5: damping 1 of a free joint is left out (may change the motion)",
                                 "line 5: stiffness 7 of a free joint is left out (may change the motion)",
                                 "line 5: frictionloss 0.3 of a free joint is left out (may change the motion)",
                                 "dry friction does not stick: it is smoothed over 0.01 rad/s, m/s (smooth_velocity)"});
  CHECK(all.dropped.empty());
  // MuJoCo's flags switch springs, dampers and dry friction off.
  const ImportedProblem none = joints("<option><flag passive='disable' frictionloss='disable'/></option>");
  CHECK(none.changed.empty());
  CHECK(tight(none).scene.forces.empty());

  const ImportedProblem urdf =
      imported_text(robot(link("a") + link("b") + joint("p", "base", "a", "<dynamics damping='3'/>", "planar") +
                          joint("f", "base", "b", "<dynamics friction='2'/>", "floating")));
  CHECK_THAT(urdf.text, Contains("line 5: damping 3 of a planar joint is left out (may change the motion)") &&
                            Contains("line 6: friction 2 of a floating joint is left out (may change the motion)"));
}

TEST_CASE("an orientation of an MJCF element goes before that of its class", "[import]") {
  const auto box = [](const std::string& defaults, const std::string& own) {
    return imported_text("<mujoco><default><geom " + defaults + "/></default><worldbody><body><joint/>" +
                         "<geom type='box' size='0.1 0.2 0.3' " + own + "/></body></worldbody></mujoco>")
        .text;
  };
  const std::string turned = box("", "euler='0 0 90'");
  CHECK(box("quat='0.6 0.8 0 0'", "euler='0 0 90'") == turned);
  CHECK(box("euler='0 0 90'", "") == turned);
  CHECK(turned != box("", ""));
  CHECK_THAT(finding_of("<mujoco><default><geom fromto='0 0 0 0 0 1'/></default><worldbody><body><joint/>"
                        "<geom type='capsule' size='0.1' pos='1 0 0'/></body></worldbody></mujoco>"),
             Contains("geom: pos: must not be given with fromto"));
  CHECK_THAT(finding_of("<mujoco><default><geom pos='1 0 0'/></default><worldbody><body><joint/>"
                        "<geom type='capsule' size='0.1' fromto='0 0 0 0 0 1'/></body></worldbody></mujoco>"),
             Contains("geom: pos: must not be given with fromto, not even by a class"));
}

TEST_CASE("a default class that is named as the one around it belongs to it", "[import]") {
  const auto model = [](const std::string& defaults) {
    return imported_text("<mujoco><default><geom type='box'/>" + defaults + "</default><worldbody><body><joint/>" +
                         "<geom class='main'/></body></worldbody></mujoco>")
        .text;
  };
  CHECK(model("<default class='main'><geom size='1 1 1'/></default>") == model("<geom size='1 1 1'/>"));
}

TEST_CASE("words of MuJoCo's options are those that it takes", "[import]") {
  const auto model = [](const std::string& settings, const std::string& weld = "") {
    return "<mujoco>" + settings + "<worldbody><body name='a'><joint/><geom size='0.1'/></body></worldbody><equality>" +
           "<weld body1='a' " + weld + "/></equality></mujoco>";
  };
  CHECK_THAT(finding_of(model("<compiler inertiafromgeom='True'/>")),
             Contains("compiler: inertiafromgeom: is 'True', must be auto or true or false"));
  CHECK_THAT(finding_of(model("<option><flag gravity='off'/></option>")),
             Contains("flag: gravity: is 'off', must be enable or disable"));
  CHECK_THAT(finding_of(model("", "active='no'")), Contains("weld: active: is 'no', must be true or false"));
  const ImportedProblem free = imported_text(model("<option><flag equality='disable'/></option>"));
  CHECK(free.joints == 1);
  CHECK_THAT(free.text, Contains("weld is not active"));
}

TEST_CASE("names keep their letters, and what is renamed is said", "[import]") {
  const ImportedProblem imported = imported_text(R"(<mujoco model="a/b"><worldbody>
  <body name="Körper"><joint name="t" axis="0 1 0"/><geom size="0.1" pos="0.2 0 0"/>
  <site name="tool" pos="0 0 -1"/><body name="tool" pos="0 0 -0.5"/></body></worldbody></mujoco>)");
  const Problem problem = tight(imported);
  CHECK(problem.scene.bodies[0].name == "Körper");
  CHECK(problem.scene.bodies[0].points.size() == 2);  // the site and the body
  CHECK_THAT(imported.text, Contains("'a/b' is named 'a_b'") && Contains("'tool' is named 'tool_2'") &&
                                Contains(R"("tool": [0, 0, -1], "tool_2": [0, 0, -0.5])"));
}

TEST_CASE("a body without mass on a joint of its own is warned of", "[import]") {
  const ImportedProblem imported =
      imported_text(robot(link("a") + "<link name=\"tip\"/>" + joint("j", "base", "a") + joint("k", "a", "tip")));
  REQUIRE(imported.warnings.size() == 1);
  CHECK_THAT(imported.warnings[0], Contains("line 4: 'tip' has no mass or inertia"));
  CHECK(imported_text(robot(link("a") + joint("j", "base", "a"))).warnings.empty());
}

TEST_CASE("a part that no body can have is refused, also where it is a part of another", "[import]") {
  const auto with = [](const std::string& mass, const std::string& J) {
    return finding_of(robot(link("a") + "<link name=\"t\"><inertial><mass value=\"" + mass + "\"/><inertia ixx=\"" + J +
                            "\" ixy=\"0\" ixz=\"0\" iyy=\"" + J + "\" iyz=\"0\" izz=\"1\"/></inertial></link>" +
                            joint("j", "base", "a") + joint("k", "a", "t", "", "fixed")));
  };
  CHECK_THAT(with("-0.5", "1"), Contains("model.xml:4:1: link 't': mass: is -0.5 kg"));
  CHECK_THAT(with("0.5", "-0.3"), Contains("model.xml:4:1: link 't': inertia: "));
  CHECK(with("0.5", "1") == "none");
}
