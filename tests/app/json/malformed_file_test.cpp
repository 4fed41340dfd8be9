// One malformed file of each kind that the problem format lists. In every text the mark @ stands in front of the place
// that the finding must point at; it is taken out before the text is read.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "app/json/input_error.hpp"
#include "app/json/read_problem.hpp"

using namespace mbsopt;

namespace {

// A problem that is right; cases replace one piece of it.
const std::string kGood = R"({
  "format": 1,
  "gravity": [0, -9.81, 0],
  "parameters": {
    "k1": {"value": 100, "lower": 1, "upper": 1e4, "unit": "N/m"},
    "theta0": 0.3
  },
  "definitions": {"half": "k1/2"},
  "bodies": [
    {"name": "crank", "mass": 1.0, "inertia": [1, 1, 1], "points": {"tip": [1, 0, 0]}},
    {"name": "rod", "mass": 2, "inertia": {"xx": 1, "yy": 1, "zz": 1}, "position": [1, 0, 0]}
  ],
  "joints": [
    {"name": "A", "type": "revolute", "body2": "crank", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "B", "type": "spherical", "body1": "crank", "body2": "rod", "point1": "tip"}
  ],
  "forces": [{"name": "s1", "type": "tsda", "body2": "crank", "point2": "tip", "stiffness": "k1", "free_length": 0.5}],
  "initial": {"conditions": [{"sensor": "crank_angle", "value": "theta0"}]},
  "sensors": {
    "crank_angle": {"quantity": "angle", "joint": "A"},
    "tip_y": {"quantity": "position", "body": "crank", "point": "tip", "component": "y"}
  },
  "simulation": {"end_time": 5},
  "objectives": {"track": {"running": "(tip_y - 0.5)^2 + 0*half"}},
  "design": {"minimize": "track", "variables": ["k1"]}
})";

struct Case {
  std::string kind;
  std::string original, replacement;  // the replacement holds the mark
  std::string path, message;          // message: a part of it
};

std::vector<Finding> findings_of(const std::string& text, const std::vector<std::string>& sets = {}) {
  try {
    read_problem_text(text, "suspension.json", sets);
  } catch (const InputError& error) {
    return error.findings();
  }
  return {};
}

std::string replaced(std::string text, const std::string& original, const std::string& replacement) {
  const std::size_t at = text.find(original);
  REQUIRE(at != std::string::npos);
  return text.replace(at, original.size(), replacement);
}

Finding at_mark(std::string& text) {
  Finding expected;
  const std::size_t mark = text.find('@');
  REQUIRE(mark != std::string::npos);
  expected.line =
      1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(mark), '\n'));
  expected.column = static_cast<int>(mark - text.rfind('\n', mark));
  text.erase(mark, 1);
  return expected;
}

const Case kCases[] = {
    {"unknown key", R"("mass": 1.0)", R"("mass": 1.0, @"colour": 3)", "bodies[0].colour", "unknown key"},
    {"misspelt key", R"("stiffness": "k1")", R"(@"stifness": "k1")", "forces[0].stifness", "did you mean 'stiffness'"},
    {"misspelt required key", R"("mass": 1.0)", R"(@"mas": 1.0)", "bodies[0].mas",
     "unknown key (did you mean 'mass'?); mass is missing; expected: [kg]"},
    {"misspelt key of the type", R"("type": "revolute")", R"(@"tpye": "revolute")", "joints[0].tpye",
     "did you mean 'type'?); type is missing; available: revolute, spherical"},
    {"unknown key at the top", R"("simulation":)", R"(@"simulatoin":)", "simulatoin", "did you mean 'simulation'"},
    {"key of another type", R"("body2": "rod", )", R"("body2": "rod", @"axis1": [1, 0, 0], )", "joints[1].axis1",
     "unknown key"},
    {"unknown body", R"("body1": "crank")", R"("body1": @"crnak")", "joints[1].body1", "did you mean 'crank'"},
    {"unknown point", R"("point1": "tip")", R"("point1": @"tpi")", "joints[1].point1", "did you mean 'tip'"},
    {"unknown joint", R"("joint": "A")", R"("joint": @"Q")", "sensors.crank_angle.joint", "there is no joint 'Q'"},
    {"unknown sensor", R"("sensor": "crank_angle")", R"("sensor": @"crankangle")", "initial.conditions[0].sensor",
     "did you mean 'crank_angle'"},
    {"unknown objective", R"("minimize": "track")", R"("minimize": @"trakc")", "design.minimize",
     "did you mean 'track'"},
    {"unknown variable", R"("variables": ["k1"])", R"("variables": ["k1", @"k2"])", "design.variables[1]",
     "there is no parameter 'k2'"},
    {"unknown name in an expression", R"("half": "k1/2")", R"("half": "k1/2 + @theta")", "definitions.half",
     "unknown name 'theta'"},
    {"unknown sensor in an objective", "tip_y - 0.5", "@tip_x - 0.5", "objectives.track.running",
     "did you mean 'tip_y'"},
    {"syntax of an expression", R"("k1/2")", R"("k1 / \u0032 + @)1")", "definitions.half", "found ')'"},
    {"wrong shape: number for a list", R"([0, -9.81, 0])", R"(@9.81)", "gravity", "must be a list of 3"},
    {"wrong shape: two numbers", R"([0, -9.81, 0])", R"(@[0, -9.81])", "gravity", "found a list of 2"},
    {"wrong shape: string for an object", R"({"end_time": 5})", R"(@"5 s")", "simulation", "must be an object"},
    {"wrong shape: true for a number", R"("mass": 1.0)", R"("mass": @true)", "bodies[0].mass", "found true"},
    {"wrong shape: null", R"("mass": 1.0)", R"("mass": @null)", "bodies[0].mass", "found null"},
    {"wrong shape: inertia", R"([1, 1, 1])", R"(@[1, 1])", "bodies[0].inertia", "[xx, yy, zz]"},
    {"wrong shape: a fraction of an iteration", R"("variables": ["k1"])",
     R"("variables": ["k1"], "optimizer": {"max_iterations": @2.5})", "design.optimizer.max_iterations",
     "must be a whole number"},
    {"missing key", R"("mass": 1.0, )", R"()", "bodies[0].mass", "is missing"},
    {"NaN", R"("mass": 1.0)", R"("mass": @NaN)", "", "NaN is not a number"},
    {"Infinity", R"("mass": 1.0)", R"("mass": @Infinity)", "", "Infinity is not a number"},
    {"negative infinity", R"("mass": 1.0)", R"("mass": @-Infinity)", "", "-Infinity is not a number"},
    {"NaN in an expression", R"("mass": 1.0)", R"("mass": "1 + @nan")", "bodies[0].mass", "not a finite number"},
    {"too large a number", R"("mass": 1.0)", R"("mass": @1e400)", "", "out of the range"},
    {"an expression that is not finite", R"("mass": 1.0)", R"~("mass": @"k1/(theta0 - 0.3)")~", "bodies[0].mass",
     "is inf at the values"},
    {"duplicate body", R"("name": "rod")", R"("name": @"crank")", "bodies[1].name", "already a body 'crank'"},
    {"duplicate joint", R"("name": "B")", R"("name": @"A")", "joints[1].name", "already a joint 'A'"},
    {"one name for two things", R"("half": "k1/2")", R"("theta0": @"k1/2", "half": 1)", "definitions.theta0",
     "taken by parameters.theta0"},
    {"a body called ground", R"("name": "rod")", R"("name": @"ground")", "bodies[1].name", "predefined"},
    {"reserved name", R"("theta0": 0.3)", R"("theta0": 0.3, "ldot": @1)", "parameters.ldot", "is reserved"},
    {"name of a function", R"("theta0": 0.3)", R"("theta0": 0.3, "sin": @1)", "parameters.sin", "function"},
    {"name that is no identifier", R"("theta0": 0.3)", R"("theta0": 0.3, "k 2": @1)", R"(parameters["k 2"])",
     "must be an identifier"},
    {"duplicate key", R"("mass": 1.0)", R"("mass": 1.0, @"mass": 2.0)", "bodies[0].mass", "is there twice"},
    {"negative mass", R"("mass": 1.0)", R"("mass": @-2)", "bodies[0].mass", "is -2 kg, a mass must not be negative"},
    {"negative mass by its parameters", R"("mass": 1.0)", R"("mass": @"theta0 - 1")", "bodies[0].mass",
     "must not be negative"},
    {"inertia not positive semidefinite", R"({"xx": 1, "yy": 1, "zz": 1})", R"(@{"xx": 1, "yy": 1, "zz": 1, "xy": 2})",
     "bodies[1].inertia", "positive semidefinite"},
    {"triangle inequality", R"([1, 1, 1])", R"(@[1, 1, 2.1])", "bodies[0].inertia",
     "the largest must not exceed the sum"},
    {"zero axis", R"("axis2": [0, 0, 1])", R"("axis2": @[0, 0, 0])", "joints[0].axis2", "is a zero vector"},
    {"zero axis of an orientation", R"("position": [1, 0, 0])",
     R"("position": [1, 0, 0], "orientation": {"axis": @[0, 0, 0], "angle": 1})", "bodies[1].orientation.axis",
     "is a zero vector"},
    {"non-unit Euler parameters", R"("position": [1, 0, 0])", R"("orientation": @[1, 0.01, 0, 0])",
     "bodies[1].orientation", "it must be 1 within 1e-6"},
    {"lower above upper", R"("lower": 1, )", R"("lower": @2e4, )", "parameters.k1.lower", "above the upper bound"},
    {"value outside its bounds", R"("value": 100, )", R"("value": @1e5, )", "parameters.k1.value",
     "above the upper bound 10000"},
    {"end before start", R"("end_time": 5)", R"("start_time": 5, "end_time": @5)", "simulation.end_time",
     "must be after start_time"},
    {"unused parameter", R"("theta0": 0.3)", R"("theta0": 0.3, "spare": @7)", "parameters.spare", "used by nothing"},
    {"parameter that cannot matter", R"("theta0": 0.3)", R"("theta0": 0.3, "k9": @7)", "parameters.k9",
     "used by nothing"},
    {"dimension mismatch", R"("mass": 1.0)", R"("mass": @"k1")", "bodies[0].mass", "has the dimension N/m"},
    {"unit that does not fit", R"("position": [1, 0, 0])", R"("position": [1, 0, @"90 [deg]"])",
     "bodies[1].position[2]", "has the dimension rad, expected is m"},
    {"dimensions mixed in a sum", R"("free_length": 0.5)", R"("free_length": "1 [m] @+ k1")", "forces[0].free_length",
     "combines m with N/m"},
    {"unit without brackets", R"("free_length": 0.5)", R"("free_length": "1 @kg")", "forces[0].free_length",
     "a unit stands in brackets: [kg]"},
    {"unit joined to its number", R"("free_length": 0.5)", R"("free_length": "1@kg")", "forces[0].free_length",
     "a unit stands in brackets: [kg]"},
    {"maximise", R"("minimize": )", R"(@"maximise": )", "design.maximise", "did you mean 'maximize'?"},
    {"unknown unit", R"("free_length": 0.5)", R"("free_length": "1 [@furlong]")", "forces[0].free_length",
     "not a known unit"},
    {"bound of another dimension", R"("lower": 1, )", R"("lower": @"1 [m]", )", "parameters.k1.lower",
     "that of the parameter is N/m"},
    {"name that is no folder", R"("format": 1)", R"("name": @"../out", "format": 1)", "name", "names a folder"},
    {"unit that is not SI", R"("unit": "N/m")", R"("unit": @"N/mm")", "parameters.k1.unit", "is not SI"},
    {"broken JSON: no comma", R"("mass": 1.0, )", R"("mass": 1.0 @"colour": )", "", "is a comma missing before it?"},
    {"broken JSON: no comma in a list", R"([0, -9.81, 0])", R"([0, -9.81 @0])", "", "is a comma missing before it?"},
    {"broken JSON: no colon", R"("mass": 1.0)", R"("mass" @1.0)", "", "expected ':'"},
    {"broken JSON: trailing comma", R"("variables": ["k1"])", R"("variables": ["k1", @])", "",
     "is there a comma too many before it?"},
    {"broken JSON: single quotes", R"("mass": 1.0)", R"(@'mass': 1.0)", "", "is not JSON"},
    {"circular definitions", R"("half": "k1/2")", R"("half": @"other", "other": "half")", "definitions.half",
     "refers to itself"},
    {"gear between bodies", R"("spherical")", R"("gear", @"body1": "crank")", "joints[1].body1", "unknown key"},
    {"gear without its joints", R"("spherical")", R"("gear")", "joints[1].joint2", "is missing"},
    {"misspelt joint type", R"("spherical")", R"(@"sperical")", "joints[1].type", "did you mean 'spherical'"},
    {"misspelt force type", R"("tsda")", R"(@"bushng")", "forces[0].type", "did you mean 'bushing'"},
    {"torque without components", R"("forces": [)", R"("forces": [@{"name": "T", "type": "torque", "body": "rod"}, )",
     "forces[0].components", "is missing"},
    {"torque with two components", R"("forces": [)",
     R"("forces": [{"name": "T", "type": "torque", "body": "rod", "components": @[1, 0]}, )", "forces[0].components",
     "must be a list of 3"},
    {"force of an unknown sensor", R"("forces": [)",
     R"("forces": [{"name": "F", "type": "force", "body": "rod", "components": [0, "-@tip_z", 0]}, )",
     "forces[0].components[1]", "did you mean 'tip_y'"},
    {"force of a wrong dimension", R"("forces": [)",
     R"("forces": [{"name": "F", "type": "force", "body": "rod", "components": [0, 0, @"3 [m]"]}, )",
     "forces[0].components[2]", "has the dimension m"},
    {"torque on the ground", R"("forces": [)",
     R"("forces": [{"name": "T", "type": "torque", "body": @"ground", "components": [1, 0, 0]}, )", "forces[0].body",
     "never moves"},
    {"bushing on one body", R"("forces": [)",
     R"("forces": [{"name": "b", "type": "bushing", "body1": "rod", "body2": @"rod"}, )", "forces[0].body2",
     "a bushing needs two bodies"},
    {"friction in a joint without an angle", R"("forces": [)",
     R"("forces": [{"name": "f", "type": "friction", "joint": @"B", "smooth_velocity": 1}, )", "forces[0].joint",
     "has no angle"},
    {"a breakaway level without a Stribeck velocity", R"("forces": [)",
     R"("forces": [@{"name": "f", "type": "friction", "joint": "A", "smooth_velocity": 1, "breakaway": 2}, )",
     "forces[0].stribeck_velocity", "is missing; give breakaway and stribeck_velocity, or neither"},
    {"friction that is not smooth", R"("forces": [)",
     R"("forces": [{"name": "f", "type": "friction", "joint": "A", "smooth_velocity": @0}, )",
     "forces[0].smooth_velocity", "must be greater than 0"},
    {"force sensor of no spring", R"("sensors": {)", R"("sensors": {"pull": {"quantity": "force", "force": @"s2"}, )",
     "sensors.pull.force", "did you mean 's1'"},
    {"sharpness of a sum", R"("(tip_y - 0.5)^2 + 0*half"})", R"("(tip_y - 0.5)^2 + 0*half", "sharpness": @3})",
     "objectives.track.sharpness", "without maximum_of"},
    {"a maximum beside another part", R"({"running": "(tip_y - 0.5)^2 + 0*half"})",
     R"(@{"running": "tip_y", "maximum_of": "tip_y"})", "objectives.track", "must be the only part"},
    {"effort of a drive that is not there", R"("sensors": {)",
     R"("sensors": {"effort": {"quantity": "drive_force", "drive": @"motor"}, )", "sensors.effort.drive",
     "there is no drive 'motor'"},
    {"events for a multistep method", R"({"end_time": 5})",
     R"({"end_time": 5, "events": @[1], "integrator": {"type": "cvodes_adams"}})", "simulation.events",
     "does not end steps there"},
    {"integrator that there is not", R"({"end_time": 5})", R"({"integrator": {"type": @"radau3"}})",
     "simulation.integrator.type", "radau5"},
    {"linear solver of the augmented Lagrangian", R"({"end_time": 5})",
     R"({"formulation": {"linear_solver": @"quasidefinite"}})", "simulation.formulation.linear_solver",
     "is of the type 'penalty' only"},
    {"unknown linear solver", R"({"end_time": 5})", R"({"formulation": {"type": "penalty", "linear_solver": @"qr"}})",
     "simulation.formulation.linear_solver", "available: cholesky, quasidefinite"},
    {"drive of a joint without an angle", R"("forces":)",
     R"("drives": [{"name": "d", "type": "angle", "joint": @"B", "law": "t"}], "forces":)", "drives[0].joint",
     "has no angle; joints that have one: revolute, cylindrical, screw"},
    {"drive without a law", R"("forces":)", R"("drives": [@{"name": "d", "type": "angle", "joint": "A"}], "forces":)",
     "drives[0].law", "is missing"},
    {"law of an unknown name", R"("forces":)",
     R"("drives": [{"name": "d", "type": "angle", "joint": "A", "law": "@omega*t"}], "forces":)", "drives[0].law",
     "unknown name 'omega'"},
    {"law from a file that is not there", R"("forces":)",
     R"("drives": [{"name": "d", "type": "angle", "joint": "A",
                    "law": {"csv": @"none.csv", "time": "t", "column": "x"}}], "forces":)",
     "drives[0].law.csv", "none.csv"},
    {"unknown integrator", R"({"end_time": 5})", R"({"integrator": {"type": @"dopri54"}})",
     "simulation.integrator.type", "did you mean 'dopri5'"},
    {"fixed-step method without a step", R"({"end_time": 5})", R"({"integrator": @{"type": "rk4"}})",
     "simulation.integrator.step", "needs a fixed step"},
    {"event that depends on a parameter", R"({"end_time": 5})", R"({"end_time": 5, "events": [1, @"k1"]})",
     "simulation.events[1]", "'k1' is a name, which is not allowed here"},
    {"event after the end", R"({"end_time": 5})", R"({"end_time": 5, "events": [@7]})", "simulation.events[0]",
     "must lie between start_time, 0 s, and end_time, 5 s"},
    {"a fixed step for CVODES", R"({"end_time": 5})", R"({"integrator": {"type": "cvodes_bdf", "step": @0.01}})",
     "simulation.integrator.step", "chooses its own steps"},
    {"tolerance of zero", R"({"end_time": 5})", R"({"integrator": {"rtol": @0}})", "simulation.integrator.rtol",
     "must be greater than 0"},
    {"tolerance of an unknown kind", R"({"end_time": 5})",
     R"({"integrator": {"rtol": {"position": 1e-6, @"speed": 1e-6}}})", "simulation.integrator.rtol.speed", "unknown"},
    {"tolerances without a kind", R"({"end_time": 5})", R"({"integrator": {"atol": @{"bodies": {"rod": 1e-6}}}})",
     "simulation.integrator.atol", "needs at least one of the tolerances"},
    {"tolerance of an unknown body", R"({"end_time": 5})",
     R"({"integrator": {"rtol": {"angle": 1e-6, "bodies": {"rood": @1e-6}}}})",
     "simulation.integrator.rtol.bodies.rood", "did you mean 'rod'"},
    {"relative tolerance above one", R"({"end_time": 5})", R"({"integrator": {"rtol": {"angle": @2, "rate": 1e-3}}})",
     "simulation.integrator.rtol.angle", "must be below 1"},
    {"tolerance of a kind that is zero", R"({"end_time": 5})", R"({"integrator": {"atol": {"rate": @0}}})",
     "simulation.integrator.atol.rate", "must be greater than 0"},
    {"component missing", R"(, "component": "y")", R"()", "sensors.tip_y.component", "is missing"},
    {"component unknown", R"("component": "y")", R"("component": @"w")", "sensors.tip_y.component",
     "available: x, y, z, norm"},
    {"rate of a rate", R"("value": "theta0")", R"("value": "theta0", "rate": @"1 [m]")", "initial.conditions[0].rate",
     "expected is rad/s"},
    {"joint of one body", R"("body1": "crank", "body2": "rod")", R"("body1": "crank", "body2": @"crank")",
     "joints[1].body2", "needs two bodies"},
    {"objective without parts", R"({"running": "(tip_y - 0.5)^2 + 0*half"})", R"(@{})", "objectives.track",
     "has no part"},
    {"optimiser that is not there", R"("variables": ["k1"])", R"("variables": ["k1"], "optimizer": {"type": @"nlopt"})",
     "design.optimizer.type",
     "available: auto, sqp, ipopt, least_squares, slsqp, mma, ccsaq, lbfgs, bobyqa, cobyla, sbplx, mlsl, direct, crs, "
     "isres, "
     "esch"},
    {"override of a parameter that is not there", R"("design":)",
     R"("cases": [{"name": "c", "overrides": {"k2": @1}}], "design":)", "cases[0].overrides.k2", "did you mean 'k1'"},
    {"override by a definition", R"("design":)",
     R"("cases": [{"name": "c", "overrides": {"k1": @"2*half"}}], "design":)", "cases[0].overrides.k1",
     "uses the definition 'half'"},
    {"two cases of one name", R"("design":)", R"("cases": [{"name": "c"}, {"name": @"c"}], "design":)", "cases[1].name",
     "already a case 'c'"},
    {"case without a name", R"("design":)", R"("cases": [@{"end_time": 2}], "design":)", "cases[0].name", "is missing"},
    {"weight of a case that is not positive", R"("design":)", R"("cases": [{"name": "c", "weight": @0}], "design":)",
     "cases[0].weight", "must be greater than 0"},
    {"case that ends before its start", R"("design":)", R"("cases": [{"name": "c", "end_time": @-1}], "design":)",
     "cases[0].end_time", "must be after its start at 0 s"},
    {"case that ends before a limit's last instant", R"("design": {)",
     R"("cases": [{"name": "c", "end_time": @2}],
  "design": {"subject_to": [{"sampled": "tip_y", "every": 0.5, "upper": 3}], )",
     "cases[0].end_time", "is 2 s, but a limit is sampled until 5 s"},
    {"case with a drive that is not there", R"("design":)",
     R"("cases": [{"name": "c", "drives": [{"drive": @"motor", "law": "t"}]}], "design":)", "cases[0].drives[0].drive",
     "there is no drive 'motor'"},
    {"case with a signal that is not there", R"("design":)",
     R"("cases": [{"name": "c", "signals": {"tau": @{"file": "a.csv", "column": "x"}}}], "design":)",
     "cases[0].signals.tau", "there is no signal 'tau'"},
    {"case with a condition on an unknown sensor", R"("design":)",
     R"("cases": [{"name": "c", "initial": {"conditions": [{"sensor": @"crank", "value": 1}]}}], "design":)",
     "cases[0].initial.conditions[0].sensor", "there is no sensor 'crank'"},
    {"maximum over cases that are not there", R"("minimize": "track")",
     R"("minimize": {"objective": "track", "over": @"max"})", "design.minimize.over", "without several"},
    {"a way over cases that there is not", R"("minimize": "track")",
     R"("minimize": {"objective": "track", "over": @"mean"})", "design.minimize.over", "available: sum, max"},
    {"expression sensor of itself", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "expression", "value": @"a + crank_angle"}, )", "sensors.a.value",
     "'a' refers to itself"},
    {"expression sensor of an unknown one", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "expression", "value": "2*@crank_angel"}, )", "sensors.a.value",
     "did you mean 'crank_angle'"},
    {"expression sensor that adds an angle to a length", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "expression", "value": "crank_angle @+ tip_y"}, )", "sensors.a.value",
     "combines rad with m"},
    {"body_angle without an axis", R"("sensors": {)",
     R"("sensors": {"a": @{"quantity": "body_angle", "body": "rod"}, )", "sensors.a.axis", "is missing"},
    {"body_angle of the ground", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "body_angle", "body": @"ground", "axis": [0, 0, 1]}, )", "sensors.a.body",
     "orientation never changes"},
    {"body_angle about no axis", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "body_angle", "body": "rod", "axis": @[0, 0, 0]}, )", "sensors.a.axis",
     "zero vector"},
    {"imu of an unknown component", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "imu", "body": "rod", "component": @"x"}, )", "sensors.a.component",
     "available: ax, ay, az, wx, wy, wz"},
    {"axes of an imu that are no orientation", R"("sensors": {)",
     R"("sensors": {"a": {"quantity": "imu", "body": "rod", "axes": @[1, 0, 0], "component": "ax"}, )",
     "sensors.a.axes", "found a list of 3"},
    {"track of a file that is not there", R"({"running": "(tip_y - 0.5)^2 + 0*half"})",
     R"({"track": [{"sensor": "tip_y", "file": @"none.csv", "column": "y"}], "parameters_only": "half"})",
     "objectives.track.track[0].file", "none.csv: there is no such file"},
    {"track of an unknown sensor", R"({"running": "(tip_y - 0.5)^2 + 0*half"})",
     R"({"track": [{"sensor": @"tip_z", "file": "none.csv", "column": "y"}], "parameters_only": "half"})",
     "objectives.track.track[0].sensor", "did you mean 'tip_y'"},
    {"peak to peak value beside another part", R"({"running": "(tip_y - 0.5)^2 + 0*half"})",
     R"(@{"running": "tip_y", "peak_to_peak_of": "tip_y"})", "objectives.track", "must be the only part"},
    {"limit on nothing", R"("variables": ["k1"])", R"("variables": ["k1"], "subject_to": [@{"upper": 3}])",
     "design.subject_to[0]", "does not say what it bounds"},
    {"limit on two things", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [@{"maximum_of": "tip_y", "rms_of": "tip_y", "upper": 3}])",
     "design.subject_to[0]", "bounds several things"},
    {"one extreme limited twice", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [{"maximum_of": "tip_y", "upper": 3}, @{"maximum_of": "tip_y", "lower": 1}])",
     "design.subject_to[1]", "once more"},
    {"limit without a value", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [@{"maximum_of": "tip_y"}])", "design.subject_to[0]",
     "at least one is needed"},
    {"instants of a limit without a step", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [@{"sampled": "tip_y", "upper": 3}])", "design.subject_to[0]",
     "only one of"},
    {"instants of a limit without number", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [{"sampled": "tip_y", "every": @1e-9, "upper": 3}])",
     "design.subject_to[0].every", "more than 10000 limits"},
    {"instants of a limit at a stroke", R"("variables": ["k1"])",
     R"("variables": ["k1"], "subject_to": [{"sampled": "tip_y", "every": @0, "upper": 3}])",
     "design.subject_to[0].every", "must be greater than 0"},
    {"table with abscissae that fall", R"("free_length": 0.5)", R"~("law": "k1*table(l, @[1, 0], [0, 1])")~",
     "forces[0].law", "abscissae must increase"},
    {"spline with too few ordinates", R"("free_length": 0.5)", R"~("law": "k1*spline(l, [0, 1, 2], @[0, 1])")~",
     "forces[0].law", "3 abscissae and 2 ordinates"},
    {"abscissa that is a parameter", R"("free_length": 0.5)", R"~("law": "table(l, [0, @theta0], [0, k1])")~",
     "forces[0].law", "must be numbers"},
    {"format of a later version", R"("format": 1)", R"("format": @2)", "format", "must be 1"},
};

}  // namespace

TEST_CASE("the problem that the cases start from is right", "[json]") {
  for (const Finding& finding : findings_of(kGood)) FAIL(to_string(finding));
}

TEST_CASE("a malformed file of each kind is reported at its line, column and path", "[json]") {
  for (const Case& c : kCases) {
    CAPTURE(c.kind);
    std::string text = replaced(kGood, c.original, c.replacement);
    const bool marked = c.replacement.find('@') != std::string::npos;
    const Finding expected = marked ? at_mark(text) : Finding{};
    const std::vector<Finding> findings = findings_of(text);
    REQUIRE(!findings.empty());
    const auto found =
        std::find_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.path == c.path; });
    std::string all;
    for (const Finding& f : findings) all += to_string(f) + "\n";
    CAPTURE(all);
    REQUIRE(found != findings.end());
    CHECK(found->source == "suspension.json");
    CHECK_THAT(found->message, Catch::Contains(c.message));
    if (!marked) continue;
    CHECK(found->line == expected.line);
    CHECK(found->column == expected.column);
  }
}

TEST_CASE("a finding is one line: file, line, column, path, message", "[json]") {
  const std::string text = replaced(kGood, R"("mass": 1.0)", R"("mass": -2)");
  CHECK_THROWS_WITH(read_problem_text(text, "suspension.json"),
                    "suspension.json:10:31: bodies[0].mass: is -2 kg, a mass must not be negative");
}

TEST_CASE("a number whose square is none is refused", "[json]") {
  const std::vector<Finding> findings = findings_of(replaced(kGood, R"("mass": 1.0)", R"("mass": "2*1e150")"));
  REQUIRE(findings.size() == 1);
  CHECK_THAT(findings[0].message, Catch::Contains("'2*1e150' is 2e+150") && Catch::Contains("at most 1e+150"));
}

TEST_CASE("a number that is not finite is said once", "[json]") {
  const auto [original, replacement] = GENERATE(table<std::string, std::string>({
      {R"("forces": [)",
       R"("forces": [{"name": "f", "type": "friction", "joint": "A", "coulomb": 1, "smooth_velocity": "-1/0"}, )"},
      {R"("mass": 1.0)", R"("mass": "-1/0")"},
  }));
  const std::vector<Finding> findings = findings_of(replaced(kGood, original, replacement));
  REQUIRE(findings.size() == 1);
  CHECK_THAT(findings[0].message, Catch::Contains("it must be finite"));
}

TEST_CASE("columns count characters, not bytes", "[json]") {
  const std::string text =
      replaced(kGood, R"("name": "crank", "mass": 1.0)", R"("name": "crank", /* \u00e4\u00f6 äö */ "mass": -2)");
  const std::vector<Finding> findings = findings_of(text);
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].column == 31 + 22);
}

TEST_CASE("all errors are reported at once, in the order of the file", "[json]") {
  std::string text = replaced(kGood, R"("mass": 1.0)", R"("mass": -2)");
  text = replaced(text, R"("axis2": [0, 0, 1])", R"("axis2": [0, 0, 0])");
  text = replaced(text, R"("stiffness": "k1")", R"("stiffness": "k1 +")");
  text = replaced(text, R"("minimize": "track")", R"("minimize": "truck", "colour": 1)");
  const std::vector<Finding> findings = findings_of(text);
  std::vector<std::string> paths;
  for (const Finding& finding : findings) paths.push_back(finding.path);
  CHECK(paths == std::vector<std::string>{"bodies[0].mass", "joints[0].axis2", "forces[0].stiffness", "design.minimize",
                                          "design.colour"});
}

TEST_CASE("a design variable that only objectives it does not use depend on is refused", "[json]") {
  std::string text = replaced(kGood, R"("theta0": 0.3)", R"("theta0": 0.3, "price": 2)");
  text = replaced(text, R"("objectives": {)", R"("objectives": {"cost": {"parameters_only": "price^2"}, )");
  CHECK(findings_of(text).empty());
  text = replaced(text, R"("variables": ["k1"])", R"("variables": ["k1", @"price"])");
  const Finding expected = at_mark(text);
  const std::vector<Finding> findings = findings_of(text);
  REQUIRE(findings.size() == 1);
  CHECK(findings[0].path == "design.variables[1]");
  CHECK(findings[0].line == expected.line);
  CHECK(findings[0].column == expected.column);
  CHECK_THAT(findings[0].message, Catch::Contains("'price' cannot influence any objective that the design"));
  CHECK(findings_of(replaced(text, R"("minimize": "track",)", R"("minimize": "cost", "subject_to": [{"objective":
        "track", "upper": 1}],)"))
            .empty());
}

TEST_CASE("an error does not drag others behind it", "[json]") {
  CHECK(findings_of(replaced(kGood, R"("mass": 1.0)", R"("mas": 1.0)")).size() == 1);
  // A mass and an inertia of a parameter or a definition that could not be read are not judged.
  const std::string massive = replaced(kGood, R"("mass": 1.0, "inertia": [1, 1, 1])", R"("mass": "k1*1 [s^2]",
      "inertia": ["half*1 [m^2*s^2]", "half*1 [m^2*s^2]", "half*1 [m^2*s^2]"])");
  CHECK(findings_of(massive).empty());
  CHECK(findings_of(replaced(massive, R"({"value": 100, )", R"({"value": "100 +", )")).size() == 1);
  CHECK(findings_of(replaced(massive, R"("half": "k1/2")", R"("half": "k1/")")).size() == 1);
  CHECK(findings_of(replaced(kGood, R"("type": "revolute")", R"("tpye": "revolute")")).size() == 1);
  // Without its type, nothing can be said about the joint's other keys; k1 is used in the force that does not parse.
  std::string text = replaced(kGood, R"("type": "revolute")", R"("type": "revolut")");
  CHECK(findings_of(text).size() == 1);
  text = replaced(kGood, R"("stiffness": "k1")", R"("stiffness": "k1 +")");
  CHECK(findings_of(text).size() == 1);
}
