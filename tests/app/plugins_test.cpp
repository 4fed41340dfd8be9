#include <catch2/catch.hpp>
#include <filesystem>
#include <string>

#include "app/json/read_problem.hpp"
#include "app/run/provenance.hpp"
#include "app/terminal/exit_code.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/problem/plugin.hpp"
#include "tests/app/killed_run.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

std::string library(const std::string& kind) { return std::string(MBSOPT_PLUGINS) + "/libplugin_" + kind + ".so"; }

std::string replaced(std::string text, const std::string& part, const std::string& by) {
  const std::size_t at = text.find(part);
  REQUIRE(at != std::string::npos);
  return text.replace(at, part.size(), by);
}

// A rod on a trolley that a law drives, a bob on the rod, drag on both.
const char* const kNamed = R"({
  "format": 1,
  "name": "trolley",
  "gravity": [0, -9.81, 0],
  "plugins": ["PLUGIN"],
  "parameters": {"c0": {"value": 0.3, "lower": 0.01, "upper": 2}, "L": {"value": 0.7, "lower": 0.4, "upper": 1.2},
                 "w": {"value": 3, "lower": 1, "upper": 5}},
  "bodies": [
    {"name": "trolley", "mass": 1, "inertia": [0.1, 0.1, 0.1]},
    {"name": "rod", "mass": 1.2, "com": ["L/2", 0, 0], "inertia": [0.001, "1.2*L^2/12", "1.2*L^2/12"],
     "points": {"tip": ["L", 0, 0]}},
    {"name": "bob", "mass": 0.4, "position": ["L", 0, 0], "inertia": [0.01, 0.01, 0.01]}],
  "joints": [
    {"name": "rail", "type": "translational", "body2": "trolley", "axis1": [1, 0, 0], "axis2": [1, 0, 0],
     "normal1": [0, 1, 0], "normal2": [0, 1, 0]},
    {"name": "pin", "type": "revolute", "body1": "trolley", "body2": "rod", "axis1": [0, 0, 1], "axis2": [0, 0, 1]},
    {"name": "hook", "type": "revolute", "body1": "rod", "body2": "bob", "point1": "tip", "axis1": [0, 0, 1],
     "axis2": [0, 0, 1]}],
  "drives": [{"name": "shaker", "type": "displacement", "joint": "rail", "law": {"user": "sine", "argument": "w*t"}}],
  "forces": [{"name": "drags", "type": "user", "force": "two_drags", "bodies": ["rod", "bob"],
              "parameters": {"c": "c0*L"}}],
  "simulation": {"end_time": 0.8, "integrator": {"type": "dopri853", "rtol": 1e-10, "atol": 1e-12}},
  "objectives": {"effort": {"user": {"cost": "effort", "bodies": ["rod", "bob"], "parameters": {"w": "2*c0"}}}},
  "design": {"minimize": "effort", "variables": ["c0", "L"], "multistart": {"starts": 6, "seed": 3}}
})";

std::string named(const std::string& kind = "good") { return replaced(kNamed, "PLUGIN", library(kind)); }

// The same in expressions.
std::string in_expressions() {
  std::string text = replaced(kNamed, "\"plugins\": [\"PLUGIN\"],", "");
  text = replaced(text, "{\"user\": \"sine\", \"argument\": \"w*t\"}", "\"sin(w*t)\"");
  const std::size_t first = text.find("{\"name\": \"drags\""), last = text.find("}}]", first) + 2;
  text.replace(first, last - first, R"(
    {"name": "drag1", "type": "force", "body": "rod", "point": ["L/2", 0, 0], "components": ["-c0*L*vx1", "-c0*L*vy1", 0]},
    {"name": "drag2", "type": "force", "body": "bob", "components": ["-2*c0*L*vx2", "-2*c0*L*vy2", 0]})");
  const std::size_t cost = text.find("{\"user\": {\"cost\""), end = text.find("}}}", cost) + 3;
  text.replace(cost, end - cost, R"cost({"running": "2*c0*(vx2^2 + vy2^2)", "terminal": "2*c0*y1^2"})cost");
  return replaced(text, "\"simulation\"", R"("sensors": {
    "vx1": {"quantity": "velocity", "body": "rod", "point": ["L/2", 0, 0], "component": "x"},
    "vy1": {"quantity": "velocity", "body": "rod", "point": ["L/2", 0, 0], "component": "y"},
    "y1": {"quantity": "position", "body": "rod", "point": ["L/2", 0, 0], "component": "y"},
    "vx2": {"quantity": "velocity", "body": "bob", "component": "x"},
    "vy2": {"quantity": "velocity", "body": "bob", "component": "y"}},
  "simulation")");
}

Evaluation gradients(const std::string& text, const ReadOptions& options, GradientMethod method) {
  const Problem problem = read_problem_text(text, "trolley.json", {}, nullptr, options);
  EvaluatorOptions by;
  by.method = method;
  return Evaluator(problem.scene, objectives_of(problem), {}, by).gradients(parameter_values(problem.scene));
}

const ReadOptions kAllowed{{}, true};

std::string refused(const std::string& text, const ReadOptions& options = kAllowed) {
  try {
    read_problem_text(text, "trolley.json", {}, nullptr, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("forces, costs and laws of a plug-in give what the same expressions give, and their gradients", "[plugin]") {
  const Evaluation reference = gradients(in_expressions(), {}, GradientMethod::adjoint);
  const Evaluation adjoint = gradients(named(), kAllowed, GradientMethod::adjoint);
  const Evaluation tlm = gradients(named(), kAllowed, GradientMethod::tlm);
  INFO(reference.message << adjoint.message << tlm.message);
  REQUIRE((reference.ok && adjoint.ok && tlm.ok));
  CHECK(adjoint.psi(0) == Approx(reference.psi(0)).epsilon(1e-9));
  CHECK(reference.psi_rho.cwiseAbs().minCoeff() > 1e-3);  // each parameter acts
  const double size = reference.psi_rho.norm();
  CHECK((adjoint.psi_rho - reference.psi_rho).norm() < 1e-8 * size);
  CHECK((tlm.psi_rho - adjoint.psi_rho).norm() < 1e-10 * size);
}

TEST_CASE("bodies and parameters of a named force go in its own order", "[plugin]") {
  const std::string swapped = replaced(named(), R"("bodies": ["rod", "bob"],
              "parameters")",
                                       R"("bodies": ["bob", "rod"],
              "parameters")");
  const Evaluation a = gradients(named(), kAllowed, GradientMethod::adjoint),
                   b = gradients(swapped, kAllowed, GradientMethod::adjoint);
  REQUIRE((a.ok && b.ok));
  CHECK(std::abs(a.psi(0) - b.psi(0)) > 1e-4);
}

TEST_CASE("plug-ins are loaded only where this is allowed, and errors name their place", "[plugin]") {
  CHECK_THAT(refused(named(), {}), Contains("trolley.json:5:14: plugins: ") && Contains("--allow-plugins"));
  CHECK_THAT(refused(named(), {}), !Contains("two_drags"));  // what follows from it is not told
  CHECK_THAT(refused(named("none")), Contains("plugins[0]: there is no file"));
  CHECK_THAT(refused(named("no_plugin")), Contains("plugins[0]: is no plug-in of mbsopt: it lacks"));
  CHECK_THAT(refused(named("other_interface")),
             Contains("plugins[0]: was compiled for another program") && Contains("mbsopt 99"));
  CHECK_THAT(refused(named("throwing")), Contains("plugins[0]: its registration threw: the licence has expired"));
  const TemporaryFolder folder;
  CHECK_THAT(refused(replaced(kNamed, "PLUGIN", folder.write("text.so", "no library"))),
             Contains("plugins[0]: cannot be loaded"));
  CHECK(std::string(kPluginInterface).starts_with("mbsopt " + program_version().substr(0, 3)));
}

TEST_CASE("unknown terms, parameters and numbers of bodies are errors with their place", "[plugin]") {
  CHECK_THAT(refused(replaced(named(), "two_drags", "two_drag")),
             Contains("forces[0].force: there is no force 'two_drag'") && Contains("did you mean 'two_drags'"));
  CHECK_THAT(refused(replaced(named(), "\"sine\"", "\"sinus\"")),
             Contains("drives[0].law.user: there is no law 'sinus'"));
  CHECK_THAT(refused(replaced(named(), "\"cost\": \"effort\"", "\"cost\": \"effect\"")),
             Contains("objectives.effort.user.cost: there is no cost 'effect'"));
  CHECK_THAT(refused(replaced(named(), "{\"c\": \"c0*L\"}", "{\"d\": \"c0*L\"}")),
             Contains("forces[0].parameters: 'c' is missing") && Contains("forces[0].parameters.d: is no parameter"));
  CHECK_THAT(refused(replaced(named(), "{\"c\": \"c0*L\"}", "{\"c\": \"c1*L\"}")),
             Contains("forces[0].parameters.c: "));
  CHECK_THAT(refused(replaced(named(), "\"bodies\": [\"rod\", \"bob\"],\n", "\"bodies\": [\"rod\"],\n")),
             Contains("forces[0].bodies: has 1 name, but 'two_drags' acts on 2 bodies"));
  CHECK_THAT(refused(replaced(named(), "\"bodies\": [\"rod\", \"bob\"],\n", "\"bodies\": [\"rod\", \"rod\"],\n")),
             Contains("forces[0].bodies[1]: 'rod' is listed twice"));
  CHECK_THAT(refused(replaced(kNamed, "\"plugins\": [\"PLUGIN\"],", "")),
             Contains("forces[0].force: there is no force 'two_drags'") && Contains("neither the program"));
}

TEST_CASE("what a term of a plug-in throws names it", "[plugin]") {
  const std::string throws =
      replaced(replaced(named(), "two_drags\", \"bodies\": [\"rod\", \"bob\"]", "thrower\", \"bodies\": [\"rod\"]"),
               "{\"c\": \"c0*L\"}", "{}");
  const TemporaryFolder folder;
  const CommandOutcome run =
      run_command({"simulate", folder.write("trolley.json", throws), "--allow-plugins", "--out", folder.file("out")});
  CHECK(run.exit_code == kNumericalFailure);
  CHECK_THAT(run.err, Contains("forces[0] (thrower) threw: no table beyond 0.1 s"));
}

TEST_CASE("check tests each term of a plug-in by its name", "[plugin]") {
  const TemporaryFolder folder;
  const auto check = [&](const std::string& text) {
    return run_command({"check", folder.write("trolley.json", text), "--allow-plugins", "--out", folder.file("out")});
  };
  const CommandOutcome right = check(named());
  INFO(right.out << right.err);
  CHECK(right.exit_code == kDone);
  const std::string wrong =
      replaced(replaced(named(), "two_drags\", \"bodies\": [\"rod\", \"bob\"]", "wrong_drag\", \"bodies\": [\"rod\"]"),
               "\"user\": \"sine\"", "\"user\": \"wrong_sine\"");
  const CommandOutcome found = check(wrong);
  CHECK(found.exit_code == kCheckFailed);
  CHECK_THAT(found.out + found.err, Contains("forces[0] (wrong_drag) (on 'rod'): its C = -dQ/dv is wrong"));
  CHECK_THAT(found.out + found.err, Contains("drive 'shaker': derivative 2 of its law's function is wrong"));
}

TEST_CASE("a design with a plug-in is killed and resumed; a plug-in that has changed is refused", "[plugin]") {
  const TemporaryFolder folder;
  fs::copy_file(library("good"), folder.path / "libmine.so");
  const std::string file = folder.write("trolley.json", replaced(kNamed, "PLUGIN", "./libmine.so"));
  const std::vector<std::string> design{"design", file, "--allow-plugins", "--threads", "2", "--quiet"};
  const auto into = [&](const std::string& name) {
    std::vector<std::string> arguments = design;
    arguments.insert(arguments.end(), {"--out", folder.file(name)});
    return arguments;
  };
  const CommandOutcome whole = run_command(into("whole"));
  INFO(whole.out << whole.err);
  REQUIRE(whole.exit_code == kDone);
  const nlohmann::json provenance = json_of(folder.path / "whole/result.json").at("provenance");
  CHECK(provenance.at("data_sha256").at("libmine.so") == sha256_of_file(folder.file("libmine.so")));
  const nlohmann::json optimized = json_of(folder.path / "whole/optimized.json");
  CHECK(optimized.at("plugins") == nlohmann::json{"../libmine.so"});

  kill_at(into("killed"), folder.path / "killed", "start", 2);
  CHECK_THAT(run_command({"resume", folder.file("killed")}).err, Contains("--allow-plugins"));
  const CommandOutcome resumed = run_command({"resume", folder.file("killed"), "--allow-plugins", "--quiet"});
  INFO(resumed.err);
  CHECK(resumed.exit_code == kDone);
  CHECK(outcome_of(folder.path / "killed") == outcome_of(folder.path / "whole"));

  kill_at(into("changed"), folder.path / "changed", "start", 2);
  std::ofstream(folder.path / "libmine.so", std::ios::app) << "changed";
  const CommandOutcome refused_run = run_command({"resume", folder.file("changed"), "--allow-plugins", "--quiet"});
  CHECK(refused_run.exit_code == kBadInput);
  CHECK_THAT(refused_run.err, Contains("begun with another content of a data file, plug-in or program"));
}

TEST_CASE("a parameter that a named force takes and does not use is an error at the first gradient", "[plugin]") {
  NamedTerms terms;
  struct Nothing final : UserForce {
    std::vector<std::string> bodies() const override { return {"rod"}; }
    void Q(double, VecIn, VecIn, VecIn, VecOut) const override {}
    void K(double, VecIn, VecIn, VecIn, MatOut) const override {}
    void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
    void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
  };
  terms.add_force("nothing", {"c"}, std::make_shared<Nothing>());
  std::string text =
      replaced(in_expressions(), "\"c0\": {\"value\": 0.3", "\"k\": {\"value\": 1}, \"c0\": {\"value\": 0.3");
  text = replaced(text, "{\"name\": \"drag1\"", R"({"name": "n", "type": "user", "force": "nothing",
    "parameters": {"c": "k"}}, {"name": "drag1")");
  const Evaluation e = gradients(text, {terms, false}, GradientMethod::adjoint);
  CHECK_FALSE(e.ok);
  CHECK_THAT(e.message, Contains("parameters.k"));
}

TEST_CASE("names of terms are taken once, and null terms are refused", "[plugin]") {
  NamedTerms terms;
  CHECK_THROWS_WITH(terms.add_law("", [](double, int) { return 0.0; }), Contains("a law has no name"));
  CHECK_THROWS_WITH(terms.add_law("f", nullptr), Contains("law 'f': there is none (null)"));
  CHECK_THROWS_WITH(terms.add_force("f", {}, nullptr), Contains("force 'f': there is none (null)"));
  terms.add_law("f", [](double, int) { return 0.0; });
  CHECK_THROWS_WITH(terms.add_law("f", [](double, int) { return 0.0; }), Contains("law 'f': the name is taken"));
}
