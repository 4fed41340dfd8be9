#include "app/json/read_problem.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "source_folder.hpp"
#include "tests/app/temporary_folder.hpp"

using namespace mbsopt;

namespace {

const std::string kFile = R"({
  "$schema": "../problem.schema.json",
  "format": 1,
  "name": "double-pendulum",              // comments are allowed
  "gravity": [0, -9.81, 0],
  "parameters": {                         /* also these */
    "k1": {"value": "0.1 [N/mm]", "lower": 1, "upper": 1e4, "scale": "log", "unit": "N/m"},
    "L1": {"value": 0.5, "unit": "m", "allow_unused": true},
    "theta0": 0.3
  },
  "definitions": {"half": "L1/2"},
  "bodies": [
    {"name": "crank", "mass": "1 + 0.5", "com": ["half", 0, 0],
     "inertia": {"xx": 1, "yy": 1, "zz": "1.5", "xy": 0.1},
     "position": [0, 0, "3 [cm]"], "orientation": {"axis": [0, 0, 2], "angle": "90 [deg]"},
     "velocity": [0, 1, 0], "angular_velocity": [0, 0, "60 [rpm]"],
     "points": {"tip": [1, 0, 0]},
     "shape": [{"type": "rod", "from": "O", "to": "tip", "radius": 0.02}]},
    {"name": "rod", "mass": 1, "inertia": [1, 1, 1], "orientation": {"rpy": [0, 0, 1]}}
  ],
  "joints": [{"name": "A", "type": "revolute", "body1": "ground", "body2": "crank",
              "point1": [0, 0, 0], "point2": "O", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
             {"name": "B", "type": "spherical", "body1": "crank", "body2": "rod", "point1": "tip"}],
  "forces": [{"name": "s1", "type": "tsda", "body1": "ground", "body2": "crank",
              "point1": [0, 1, 0], "point2": "tip", "stiffness": "k1", "damping": 1, "free_length": 0.5},
             {"name": "s2", "type": "rsda", "joint": "A", "law": "0.1*rate + 3*sin(angle)*t"}],
  "initial": {"conditions": [{"sensor": "crank_angle", "value": "theta0", "rate": 0}]},
  "sensors": {"tip_y": {"quantity": "position", "body": "crank", "point": "tip", "component": "y",
                        "relative_to": {"body": "rod"}, "frame": "body"},
              "crank_angle": {"quantity": "angle", "joint": "A"}},
  "simulation": {"start_time": 0, "end_time": "500 [ms]", "output_step": 0.01,
                 "formulation": {"type": "penalty", "alpha": 1e7, "linear_solver": "quasidefinite"},
                 "integrator": {"type": "dopri853", "rtol": 1e-7, "atol": 1e-9, "max_steps": 1e6}},
  "objectives": {"track": {"running": "(tip_y - 0.5)^2", "terminal": "0", "parameters_only": "0",
                           "samples": [{"time": 0.25, "value": "crank_angle^2"}]}},
  "design": {"minimize": "track", "subject_to": [{"objective": "track", "upper": 0.2}],
             "variables": ["k1"], "optimizer": {"type": "ipopt", "tolerance": 1e-7, "max_iterations": 50}}
})";

std::string error_of(const std::vector<std::string>& sets) {
  try {
    read_problem_text(kFile, "p.json", sets);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a problem is read field by field", "[json]") {
  const Problem problem = read_problem_text(kFile, "p.json");
  const Scene& scene = problem.scene;
  CHECK(scene.name == "double-pendulum");
  CHECK(scene.gravity[1].number() == -9.81);
  REQUIRE(scene.parameters.size() == 3);
  CHECK(scene.parameters[0].name == "k1");
  CHECK(scene.parameters[0].value == Approx(100).epsilon(1e-15));
  CHECK(scene.parameters[0].lower == 1.0);
  CHECK(scene.parameters[0].upper == 1e4);
  CHECK(scene.parameters[0].scale == ParameterScale::log);
  CHECK(scene.parameters[1].allow_unused);
  CHECK(scene.parameters[2].value == 0.3);
  CHECK(scene.definitions.at(0).value.text() == "L1/2");
  REQUIRE(scene.bodies.size() == 2);
  const Body& crank = scene.bodies[0];
  CHECK(crank.mass.number() == 1.5);
  CHECK(crank.com[0].text() == "half");
  CHECK(crank.inertia.zz.number() == 1.5);
  CHECK(crank.inertia.xy.number() == 0.1);
  CHECK(crank.inertia.yz.number() == 0);
  CHECK(crank.position[2].number() == 0.03);
  CHECK(std::get<AxisAngleField>(crank.orientation).angle.number() == Approx(std::numbers::pi / 2));
  CHECK(crank.angular_velocity[2].number() == Approx(2 * std::numbers::pi));
  CHECK(crank.points.at("tip")[0].number() == 1);
  CHECK(crank.shapes.at(0).radius == 0.02);
  CHECK(std::get<RollPitchYawField>(scene.bodies[1].orientation).rpy[2].number() == 1);
  CHECK(std::get<EulerParametersField>(Body().orientation).e[0].number() == 1);
  CHECK(scene.joints.at(0).type == "revolute");
  CHECK(std::get<std::string>(scene.joints[0].point2) == "O");
  CHECK(std::get<VectorField>(*scene.joints[0].axis1)[2].number() == 1);
  CHECK_FALSE(scene.joints[0].normal1);
  CHECK(std::get<std::string>(scene.joints[1].point1) == "tip");
  CHECK(std::get<Tsda>(scene.forces.at(0).kind).stiffness.text() == "k1");
  CHECK(std::get<Rsda>(scene.forces.at(1).kind).law->text() == "0.1*rate + 3*sin(angle)*t");
  CHECK(scene.conditions.at(0).rate->number() == 0);
  REQUIRE(scene.sensors.size() == 2);
  CHECK(scene.sensors[0].name == "tip_y");
  CHECK(scene.sensors[0].relative_to->body == "rod");
  CHECK(scene.sensors[0].in_body_frame);
  CHECK(scene.simulation.end_time == 0.5);
  CHECK(scene.simulation.output_step == 0.01);
  CHECK(scene.simulation.formulation.type == FormulationType::penalty);
  CHECK(scene.simulation.formulation.alpha == 1e7);
  CHECK(scene.simulation.formulation.linear_solver == LinearSolver::quasidefinite);
  CHECK(scene.simulation.formulation.omega == 10);  // penalty's own default
  CHECK(scene.simulation.formulation.projection == Projection::none);
  CHECK(scene.simulation.integrator.type == "dopri853");
  CHECK(scene.simulation.integrator.max_steps == 1000000);
  CHECK(problem.objectives.at(0).samples.at(0).time == 0.25);
  REQUIRE(problem.design);
  CHECK(problem.design->subject_to.at(0).upper == 0.2);
  CHECK(problem.design->variables == std::vector<std::string>{"k1"});
  CHECK(problem.design->optimizer.max_iterations == 50);
  CHECK_FALSE(problem.identification);
}

TEST_CASE("an identification is read, its data found beside the problem file", "[json]") {
  const TemporaryFolder folder;
  folder.write("run.csv", "t,time,x\n0,1,0.1\n0.5,1.5,0.2\n1,2,0.3\n");
  const std::string text =
      R"({"parameters": {"m": 1, "g0": 1, "th": 0},
 "bodies": [{"name": "a", "mass": "m", "inertia": [1, 1, 1], "position": ["th", 0, 0]}],
 "sensors": {"x": {"quantity": "position", "body": "a", "component": "x"}},
 "identification": {"variables": ["m"], "loss": {"type": "squared"}, "sigma_is_known": true,
   "optimizer": {"tolerance": 1e-8},
   "experiments": [
   {"name": "r", "data": "run.csv", "time": "time", "start_time": 1, "end_time": 2,
    "overrides": {"th": 0.3}, "free": ["th"],
    "channels": [{"column": "x", "sensor": "x", "sigma": 0.01, "gain": "g0", "bias": "2 [mm]"}]},
   {"name": "v", "data": "run.csv", "role": "validate", "channels": [{"column": "x", "sensor": "x"}]}]}})";
  const Problem problem = read_problem_text(text, folder.path / "p.json");
  REQUIRE(problem.identification);
  const IdentificationSpec& identification = *problem.identification;
  CHECK(identification.sigma_is_known);
  CHECK(identification.tolerance == 1e-8);
  REQUIRE(identification.experiments.size() == 2);
  const ExperimentSpec& run = identification.experiments[0];
  CHECK(run.data == std::vector{std::string(folder.file("run.csv"))});
  CHECK(run.time == "time");
  CHECK(run.start_time == 1.0);
  CHECK(run.overrides == std::vector<std::pair<std::string, double>>{{"th", 0.3}});
  CHECK(run.free == std::vector<std::string>{"th"});
  CHECK_FALSE(run.validate);
  CHECK(run.channels.at(0).bias.number() == 0.002);
  CHECK(identification.experiments[1].validate);
}

namespace {

const std::string kRobust = R"({"parameters": {
   "m": {"value": 1, "prior": {"type": "normal", "mean": 1.5, "sigma": 0.25}}, "w": 0.1},
 "bodies": [{"name": "a", "mass": "m", "inertia": {"consistent": {"x": "w", "y": 0.2, "z": 0.3, "xz": 0.01}}}],
 "joints": [{"name": "rail", "type": "translational", "body2": "a", "axis1": [1, 0, 0], "axis2": [1, 0, 0]}],
 "drives": [{"name": "push", "type": "displacement", "joint": "rail", "law": "0.1*t"}],
 "sensors": {"e": {"quantity": "energy", "component": "kinetic"}},
 "identification": {"variables": ["m"], "loss": {"type": "huber", "scale": 2}, "experiments": [
   {"name": "r", "data": "../data/pendulum/free_swing.csv", "drives": [{"drive": "push", "law": "0.5*t"}],
    "channels": [{"column": "theta", "sensor": "e", "delay": "20 [ms]", "estimate_sigma": true}]}]}})";

}  // namespace

TEST_CASE("losses, priors, delays, laws of an experiment and consistent inertia are read", "[json]") {
  // The rail leaves the inertia without influence.
  const Problem problem = read_problem_text(kRobust, MBSOPT_SOURCE_DIR "/problems/p.json",
                                            {"parameters.w={\"value\": 0.1, \"allow_unused\": true}"});
  REQUIRE(problem.scene.parameters[0].prior);
  CHECK(problem.scene.parameters[0].prior->mean == 1.5);
  CHECK(problem.scene.parameters[0].prior->sigma == 0.25);
  CHECK_FALSE(problem.scene.parameters[1].prior);
  REQUIRE(problem.scene.bodies[0].consistent_inertia);
  CHECK(problem.scene.bodies[0].consistent_inertia->x.text() == "w");
  CHECK(problem.scene.bodies[0].consistent_inertia->xz.number() == 0.01);
  CHECK(problem.scene.bodies[0].consistent_inertia->xy.number() == 0);
  const IdentificationSpec& identification = *problem.identification;
  CHECK(identification.loss.type == LossType::huber);
  CHECK(identification.loss.scale == 2.0);
  const ExperimentSpec& run = identification.experiments[0];
  CHECK(run.channels[0].delay.number() == 0.02);
  CHECK(run.channels[0].estimate_sigma == SigmaEstimate::own);
  REQUIRE(run.drives.size() == 1);
  CHECK(run.drives[0].drive == "push");
  CHECK(run.drives[0].law.text() == "0.5*t");
  for (const auto& [word, type] : {std::pair("squared", LossType::squared), std::pair("cauchy", LossType::cauchy),
                                   std::pair("tukey", LossType::tukey)}) {
    const Problem other = read_problem_text(kRobust, MBSOPT_SOURCE_DIR "/problems/p.json",
                                            {"parameters.w={\"value\": 0.1, \"allow_unused\": true}",
                                             std::string("identification.loss={\"type\": \"") + word + "\"}"});
    CHECK(other.identification->loss.type == type);
    CHECK_FALSE(other.identification->loss.scale);
  }
}

TEST_CASE("--set changes values and creates what the format allows", "[json]") {
  const Problem problem =
      read_problem_text(kFile, "p.json",
                        {"parameters.k1.value=120", "bodies[1].mass=2*k1/1 [N/m]", "parameters.theta0.lower=0",
                         "name=other", "simulation.integrator.max_step=0.1", "bodies[1].points.end=[1, 2, 3]",
                         "gravity[1]=0", R"(objectives.extra={"terminal": "tip_y"})"});
  CHECK(problem.scene.parameters[0].value == 120);
  CHECK(problem.scene.parameters[2].lower == 0.0);
  CHECK(problem.scene.parameters[2].value == 0.3);
  CHECK(problem.scene.bodies[1].mass.text() == "2*k1/1 [N/m]");
  CHECK(problem.scene.name == "other");
  CHECK(problem.scene.simulation.integrator.max_step == 0.1);
  CHECK(problem.scene.bodies[1].points.at("end")[2].number() == 3);
  CHECK(problem.scene.gravity[1].number() == 0);
  CHECK(problem.objectives.at(1).terminal->text() == "tip_y");
}

TEST_CASE("errors of a --set are reported under its path", "[json]") {
  CHECK(error_of({"bodies[0].mass=-2"}) == "--set bodies[0].mass: is -2 kg, a mass must not be negative");
  CHECK_THAT(error_of({"bodies[0].mas=2"}),
             Catch::StartsWith("--set bodies[0].mas: unknown key (did you mean 'mass'?)"));
  CHECK_THAT(error_of({"bodies[7].mass=2"}), Catch::Contains("--set bodies[7].mass: bodies has 2 entries"));
  CHECK_THAT(error_of({"objectives.track.samples[1].time=2"}),
             Catch::Contains("objectives.track.samples has 1 entry, numbered from 0"));
  CHECK_THAT(error_of({"design.subject_too[0].upper=2"}),
             Catch::Contains("there is no design.subject_too") && Catch::Contains("design.subject_too=[...]"));
  CHECK_THAT(error_of({"name.first=2"}), Catch::Contains("name is the string 'double-pendulum', not an object"));
  CHECK_THAT(error_of({"bodies.mass=2"}), Catch::Contains("bodies is a list of 2, not an object"));
  CHECK_THAT(error_of({"bodies[x].mass=2"}), Catch::Contains("an index in [] must be a whole number"));
  CHECK_THAT(error_of({"k1"}), Catch::Contains("must be written path=value"));
  CHECK_THAT(error_of({"=3"}), Catch::Contains("is not a path"));
  CHECK_THAT(error_of({"bodies[0].mass=1 +"}), Catch::Contains("(at character 4)"));
  CHECK_THAT(error_of({"parameters.k1.upper=10"}), Catch::Contains("parameters.k1.value: is 100"));
}

TEST_CASE("what deserves a word but is no error is a warning", "[json]") {
  std::vector<std::string> warnings;
  read_problem_text(kFile, "p.json", {"forces[1].stiffness=3"}, &warnings);
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], Catch::StartsWith("p.json:") &&
                              Catch::Contains(": forces[1].law: replaces the coefficients of this force: stiffness,"));
}

TEST_CASE("an option of the integrator that the method does not use is refused at its path", "[json]") {
  const std::string options = "simulation.integrator.options.";
  const auto refused = [&](const std::string& type, const std::string& key, const std::string& value) {
    const std::string error = error_of({"simulation.integrator.type=" + type, options + key + "=" + value});
    INFO(type << " " << key << ": " << error);
    return error.find(options + key + ": ") != std::string::npos;
  };
  for (const char* key : {"newton_tolerance", "newton_iterations"}) {
    const std::string value = std::string(key) == "newton_iterations" ? "4" : "0.1";
    CHECK(refused("dopri5", key, value));
    CHECK(refused("cvodes_adams", key, value));
    CHECK(refused("rodas4", key, value));
    CHECK_FALSE(refused("cvodes_bdf", key, value));
    CHECK_FALSE(refused("radau5", key, value));
  }
  for (const auto& [key, value] :
       {std::pair{"factor_min", "0.3"}, {"factor_max", "4"}, {"safety", "0.8"}, {"controller", "I"}}) {
    CHECK(refused("cvodes_bdf", key, value));
    CHECK_FALSE(refused("dopri5", key, value));
    CHECK_FALSE(refused("radau5", key, value));
  }
  CHECK_FALSE(refused("cvodes_adams", "min_step", "1e-9"));
  const std::string fixed = error_of({"simulation.integrator.step=0.01", options + "min_step=1e-9",
                                      options + "safety=0.8", options + "controller=PI"});
  for (const char* key : {"min_step", "safety", "controller"})
    CHECK(fixed.find(options + key + ": is given, but the step is fixed") != std::string::npos);
}

TEST_CASE("options of the integrator have ranges", "[json]") {
  const std::string options = "simulation.integrator.options.";
  for (const auto& [key, value] : {std::pair{"factor_min", "1"},
                                   {"factor_min", "0"},
                                   {"factor_max", "1"},
                                   {"safety", "1"},
                                   {"safety", "-1"},
                                   {"min_step", "0"},
                                   {"newton_tolerance", "1"},
                                   {"newton_iterations", "0"},
                                   {"newton_iterations", "2.5"},
                                   {"controller", "PD"}}) {
    const std::string error = error_of({"simulation.integrator.type=radau5", options + key + "=" + value});
    INFO(key << "=" << value << ": " << error);
    CHECK(error.find(options + key + ": ") != std::string::npos);
  }
  const std::string error = error_of({"simulation.integrator.max_step=1e-3", options + "min_step=1e-2"});
  CHECK(error.find(options + "min_step: is 0.01 s, above max_step") != std::string::npos);
}

TEST_CASE("a limit on a mean of an expression becomes one on an objective of its own", "[read_problem]") {
  const std::string limit = "design.subject_to=[{\"maximum_of\": \"tip_y + 1\", \"lower\": -4, \"upper\": 2}]";
  const Problem problem = read_problem_text(kFile, "file.json", {limit});
  const ObjectiveBound& bound = problem.design->subject_to.at(0);
  CHECK(bound.objective == "maximum_of tip_y + 1");
  const ObjectiveSpec& objective = problem.objectives.back();
  CHECK(objective.name == bound.objective);
  CHECK(objective.sharpness == 25);  // 100/4
  const auto of = [](const std::string& bounds) { return error_of({"design.subject_to=[" + bounds + "]"}); };
  CHECK_THAT(of(R"({"upper": 2})"), Catch::Contains("design.subject_to[0]: does not say what it bounds"));
  CHECK_THAT(of(R"({"objective": "track", "rms_of": "tip_y", "upper": 2})"),
             Catch::Contains("design.subject_to[0]: bounds several things"));
  CHECK_THAT(of(R"({"objective": "track", "sharpness": 3, "upper": 2})"),
             Catch::Contains("design.subject_to[0].sharpness: is given without maximum_of"));
  CHECK_THAT(of(R"({"maximum_of": "tip_z", "upper": 2})"),
             Catch::Contains("design.subject_to[0].maximum_of: ") && Catch::Contains("tip_y"));
  CHECK_THAT(of(R"({"maximum_of": "tip_y"})"), Catch::Contains("has neither \"lower\" nor \"upper\""));
  CHECK_THAT(of(R"({"maximum_of": "tip_y", "upper": 2}, {"maximum_of": "tip_y", "lower": 1})"),
             Catch::Contains("design.subject_to[1]: bounds maximum_of tip_y once more"));
}

TEST_CASE("misuses of load cases are found at their places", "[read_problem]") {
  const auto of = [](const std::string& cases) { return error_of({"cases=[" + cases + "]"}); };
  CHECK(of(R"({"name": "cold", "overrides": {"k1": "1.2*k1 + theta0"}, "end_time": 3})").empty());
  CHECK_THAT(of(R"({"name": "cold", "overrides": {"k2": 1}})"),
             Catch::Contains("cases[0].overrides.k2: there is no parameter 'k2' (did you mean 'k1'?)"));
  CHECK_THAT(of(R"({"name": "cold", "overrides": {"k1": "half"}})"), Catch::Contains("uses the definition 'half'"));
  CHECK_THAT(of(R"({"name": "cold", "overrides": {"k1": "tip_y"}})"), Catch::Contains("cases[0].overrides.k1: "));
  CHECK_THAT(of(R"({"name": "cold"}, {"name": "cold"})"),
             Catch::Contains("cases[1].name: there is already a case 'cold'"));
  CHECK_THAT(of(R"({"name": "cold", "end_time": -1})"), Catch::Contains("cases[0].end_time: the case ends at -1 s"));
  CHECK_THAT(of(R"({"name": "cold", "weight": 0})"), Catch::Contains("cases[0].weight"));
  CHECK_THAT(error_of({"design.minimize={\"objective\": \"track\", \"over\": \"max\"}"}),
             Catch::Contains("design.minimize.over: is \"max\""));
  CHECK_THAT(error_of({"design.minimize={\"objective\": \"trak\"}"}), Catch::Contains("design.minimize"));
}
