#include <catch2/catch.hpp>

#include "app/terminal/exit_code.hpp"
#include "source_folder.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

TEST_CASE("gradient: every method gives every objective and parameter the same derivative", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  nlohmann::json reference;
  for (const std::string method : {"auto", "tlm", "adjoint", "fd"}) {
    const CommandOutcome outcome = run_command({"gradient", file, "--out", folder.file("out"), "--method", method});
    REQUIRE(outcome.exit_code == kDone);
    CHECK_THAT(outcome.out, Contains("track") && Contains("L"));
    const auto objectives = json_of(folder.path / "out/result.json").at("objectives");
    if (reference.is_null()) reference = objectives;
    for (const char* objective : {"track", "end"}) {
      for (const char* parameter : {"L", "k"}) {
        const double derivative = objectives.at(objective).at("gradient").at(parameter);
        CHECK(derivative != 0);
        CHECK(derivative == Approx(reference.at(objective).at("gradient").at(parameter).get<double>()).epsilon(1e-7));
      }
    }
  }
}

// exp(1000 x) passes 1e120 where its derivative changes its sign.
TEST_CASE("gradient by cvodes_forward gets through a sharp extreme", "[command]") {
  const TemporaryFolder folder;
  const std::string file = MBSOPT_SOURCE_DIR "/problems/four_bar/balanced.json";
  nlohmann::json travel;
  for (const char* const method : {"adjoint", "cvodes_forward"}) {
    const CommandOutcome outcome = run_command({"gradient", file, "--out", folder.file("out"), "--method", method});
    INFO(outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    const nlohmann::json found = json_of(folder.path / "out/result.json").at("objectives").at("travel").at("gradient");
    if (travel.is_null()) travel = found;
    for (const auto& [name, derivative] : travel.items())
      CHECK(found.at(name).get<double>() == Approx(derivative.get<double>()).epsilon(1e-6));
  }
}

TEST_CASE("gradient: a method that does not exist, and a file without objectives, are bad input", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  CHECK(run_command({"gradient", file, "--method", "magic"}).exit_code == kBadInput);
  std::string text = kPendulum;
  const auto begin = text.find(",\n  \"objectives\"");
  text.erase(begin, text.rfind('}') - begin);
  const CommandOutcome outcome =
      run_command({"gradient", folder.write("bare.json", text), "--out", folder.file("out")});
  CHECK(outcome.exit_code == kBadInput);
  CHECK_THAT(outcome.err, Contains("objectives"));
}

namespace {

// x(2 s) = 2 v0 + 2 F/m
const char* const kFlight = R"({
  "format": 1,
  "name": "flight",
  "gravity": [0, 0, 0],
  "parameters": {"m": {"value": 1.6, "unit": "kg"}, "F": {"value": 3, "unit": "N"},
                 "v0": {"value": -0.5, "unit": "m/s"}},
  "bodies": [{"name": "body", "mass": "m", "inertia": [0.2, 0.3, 0.4], "velocity": ["v0", 0, 0]}],
  "forces": [{"name": "push", "type": "force", "body": "body", "components": ["F", 0, 0]}],
  "sensors": {"x": {"quantity": "position", "body": "body", "component": "x"}},
  "simulation": {"end_time": 2},
  "objectives": {"end": {"terminal": "x", "parameters_only": "F^2"}, "start": {"parameters_only": "2*v0*F"}}
})";

}  // namespace

TEST_CASE("gradient --hessian: second derivatives by name, with their error and in words what they are", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("flight.json", kFlight);
  const std::string method = GENERATE(as<std::string>{}, "auto", "adjoint", "tlm");
  const CommandOutcome outcome =
      run_command({"gradient", file, "--hessian", "--out", folder.file("out"), "--method", method});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.out, Contains("second derivatives by central differences") &&
                              Contains("not forward over adjoint") && Contains("d2 end") && Contains("d2 start"));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK_THAT(result.at("hessian_method").get<std::string>(),
             Contains(method == "tlm" ? "tangent-linear gradient" : "adjoint gradient") && Contains("frozen steps") &&
                 Contains("not forward over adjoint"));
  CHECK(result.at("methods").contains(method == "tlm" ? "tlm" : "adjoint"));
  CHECK(result.at("methods").at("hessian").at("gradients") > 3);
  const auto& end = result.at("objectives").at("end");
  CHECK(end.at("gradient").at("F").get<double>() == Approx(2 / 1.6 + 6));
  CHECK(end.at("hessian_error").get<double>() < 1e-8);
  const double m = 1.6, F = 3;
  const nlohmann::json expected = {{"m", {{"m", 4 * F / (m * m * m)}, {"F", -2 / (m * m)}, {"v0", 0}}},
                                   {"F", {{"m", -2 / (m * m)}, {"F", 2}, {"v0", 0}}},
                                   {"v0", {{"m", 0}, {"F", 0}, {"v0", 0}}}};
  for (const char* p : {"m", "F", "v0"}) {
    for (const char* q : {"m", "F", "v0"}) {
      INFO(p << " " << q);
      CHECK(end.at("hessian").at(p).at(q).get<double>() == Approx(expected.at(p).at(q).get<double>()).margin(1e-8));
    }
  }
  const auto& start = result.at("objectives").at("start").at("hessian");
  CHECK(start.at("F").at("v0").get<double>() == Approx(2).epsilon(1e-9));
  CHECK(start.at("m").at("F") == 0);
}

TEST_CASE("gradient --hessian through joints and assembly: the slope of the gradient", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const std::vector<std::string> tight{"--set", "simulation.integrator.rtol=1e-11",
                                       "--set", "simulation.integrator.atol=1e-13",
                                       "--set", "simulation.integrator.type=dopri853"};
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments{"gradient", file, "--out", folder.file("out")};
    arguments.insert(arguments.end(), tight.begin(), tight.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    const CommandOutcome outcome = run_command(arguments);
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.exit_code == kDone);
    return json_of(folder.path / "out/result.json");
  };
  const auto result = run({"--hessian"});
  const auto longer = run({"--set", "parameters.L.value=1.001"}), shorter = run({"--set", "parameters.L.value=0.999"});
  CHECK_FALSE(longer.contains("hessian_method"));
  for (const char* objective : {"track", "end"}) {
    for (const char* parameter : {"L", "k"}) {
      const auto slope = [&](const nlohmann::json& at) {
        return at.at("objectives").at(objective).at("gradient").at(parameter).get<double>();
      };
      INFO(objective << " " << parameter);
      const auto& hessian = result.at("objectives").at(objective).at("hessian");
      CHECK(hessian.at("L").at(parameter).get<double>() ==
            Approx((slope(longer) - slope(shorter)) / 0.002).epsilon(1e-4));
      CHECK(hessian.at("L").at(parameter) == hessian.at(parameter).at("L"));
    }
  }
}

TEST_CASE("gradient --hessian warns of an objective with a kink, whose differences have no limit", "[command]") {
  const TemporaryFolder folder;
  const CommandOutcome outcome =
      run_command({"gradient", folder.write("flight.json", kFlight), "--hessian", "--out", folder.file("out"), "--set",
                   "objectives.start.parameters_only=\"abs(v0 + 0.5) + F\""});
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  CHECK_THAT(outcome.err, Contains("second derivatives of 'start'") && Contains("is it smooth here") &&
                              !Contains("second derivatives of 'end'"));
  const auto result = json_of(folder.path / "out/result.json");
  CHECK(result.at("objectives").at("start").at("hessian_error") > 0.1);
  CHECK(result.at("warnings").size() == 1);
}

TEST_CASE("gradient --hessian is refused where there is no discrete gradient on frozen steps", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("flight.json", kFlight), out = folder.file("out");
  const CommandOutcome by_cvodes =
      run_command({"gradient", file, "--hessian", "--out", out, "--set", "simulation.integrator.type=cvodes_adams"});
  CHECK(by_cvodes.exit_code == kBadInput);
  CHECK_THAT(by_cvodes.err, Contains("simulation.integrator.type: is cvodes_adams") && Contains("frozen"));
  for (const std::string method : {"fd", "cvodes_forward", "cvodes_adjoint"}) {
    const CommandOutcome outcome = run_command({"gradient", file, "--hessian", "--out", out, "--method", method});
    CHECK(outcome.exit_code == kBadInput);
    CHECK_THAT(outcome.err, Contains("second derivatives by " + method + ": there are none"));
  }
  CHECK_THAT(run_command({"gradient", "--help"}).out, Contains("--hessian") && Contains("not forward over adjoint"));
}

TEST_CASE("gradient shows on a terminal how far it is", "[command]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("flight.json", kFlight);
  for (const std::string method : {"adjoint", "tlm"}) {
    std::ostringstream out, err;
    REQUIRE(run_command_line({"gradient", file, "--out", folder.file("out"), "--method", method}, out, err, true) ==
            kDone);
    CHECK_THAT(err.str(), Contains("differentiating [") && Contains("100 %") && Catch::EndsWith("\r\x1b[K"));
  }
}
