// What a scene does not require costs nothing, as the counters in result.json show.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

// A pendulum, pinned at x, on a spring.
std::string body(const std::string& name, const char* x) {
  return R"({"name": ")" + name + R"(", "mass": "m", "com": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1], "position": [)" +
         x + R"(, 0, 0], "points": {"tip": [1, 0, 0]}})";
}
std::string pin(const std::string& name, const char* x) {
  return R"({"name": "pin_)" + name + R"(", "type": "revolute", "body2": ")" + name + R"(", "point1": [)" + x +
         R"(, 0, 0], "axis1": [0, 0, 1], "axis2": [0, 0, 1]})";
}
std::string spring(const std::string& name, const char* x) {
  return R"({"name": "spring_)" + name + R"(", "type": "tsda", "body2": ")" + name + R"(", "point1": [)" + x +
         R"(, 1, 0], "point2": "tip", "stiffness": "k", "free_length": 0.5})";
}
std::string sensor(const std::string& name) {
  return R"("y_)" + name + R"(": {"quantity": "position", "body": ")" + name +
         R"(", "point": "tip", "component": "y"})";
}

std::string scene(const std::string& bodies, const std::string& joints, const std::string& forces,
                  const std::string& sensors, const std::string& objectives) {
  return R"({"format": 1, "name": "pendulums", "gravity": [0, -9.81, 0], "parameters": {"m": 2, "k": 30},
    "bodies": [)" +
         bodies + R"(], "joints": [)" + joints + R"(], "forces": [)" + forces + R"(], "sensors": {)" + sensors +
         R"(}, "simulation": {"end_time": 1, "integrator": {"type": "dopri5", "step": 0.01}}, "objectives": {)" +
         objectives + "}}";
}

const char* const kEnd = R"("end": {"terminal": "y_a"})";

std::string one(const std::string& objectives = kEnd) {
  return scene(body("a", "0"), pin("a", "0"), spring("a", "0"), sensor("a"), objectives);
}
// The second swings on its own, unless something is added that connects it.
std::string two(const std::string& more_forces = "", const std::string& objectives = kEnd) {
  return scene(body("a", "0") + "," + body("b", "5"), pin("a", "0") + "," + pin("b", "5"),
               spring("a", "0") + "," + spring("b", "5") + more_forces, sensor("a") + "," + sensor("b"), objectives);
}

struct Costs {
  nlohmann::json result;
  std::string out;
  long counter(const char* name) const { return result.at("simulation").at(name).get<long>(); }
  const nlohmann::json& gradient(const char* objective = "end") const {
    return result.at("objectives").at(objective).at("gradient");
  }
};

Costs costs(const char* command, const std::string& text, const std::vector<std::string>& more = {}) {
  const TemporaryFolder folder;
  std::vector<std::string> arguments{command, folder.write("p.json", text), "--quiet", "--out", folder.file("out")};
  arguments.insert(arguments.end(), more.begin(), more.end());
  const CommandOutcome outcome = run_command(arguments);
  INFO(outcome.out << outcome.err);
  REQUIRE(outcome.exit_code == kDone);
  return {json_of(folder.path / "out/result.json"), outcome.out};
}

constexpr const char* kCounters[] = {"steps", "rhs_evaluations", "factorisations", "factor_blocks",
                                     "linearised_states"};

}  // namespace

TEST_CASE("bodies that no objective depends on cost a gradient nothing, and that is said", "[costs]") {
  for (const char* method : {"adjoint", "tlm"}) {
    INFO(method);
    const Costs alone = costs("gradient", one(), {"--method", method});
    const Costs both = costs("gradient", two(), {"--method", method});
    for (const char* counter : kCounters) {
      INFO(counter);
      CHECK(both.counter(counter) == alone.counter(counter));
      CHECK(both.counter(counter) > 0);
    }
    CHECK(both.gradient() == alone.gradient());
    CHECK(both.result.at("model").at("left_out") == nlohmann::json{"b"});
    CHECK_THAT(both.out, Contains("no objective depends on them: b"));
    CHECK_FALSE(alone.result.at("model").contains("left_out"));
  }
}

TEST_CASE("bodies that no objective depends on cost a check of the gradients nothing", "[costs]") {
  const Costs alone = costs("check", one()), both = costs("check", two());
  for (const char* counter : kCounters) {
    INFO(counter);
    CHECK(both.counter(counter) == alone.counter(counter));
  }
  CHECK(both.counter("derivative_blocks") == alone.counter("derivative_blocks"));
  CHECK(both.gradient() == alone.gradient());
  CHECK(both.result.at("model").at("left_out") == nlohmann::json{"b"});
  CHECK(both.result.at("model").at("bodies") == 2);
  CHECK_THAT(both.out, Contains("no objective depends on them: b"));
}

TEST_CASE("bodies that nothing measured depends on cost an identification nothing, and change nothing of it",
          "[costs]") {
  const TemporaryFolder folder;
  std::string rows = "t,y\n";
  for (int i = 1; i <= 20; ++i) rows += fmt::format("{},{}\n", 0.05 * i, -0.4 * std::sin(0.1 * i));
  const std::string identification =
      R"(, "identification": {"experiments": [{"name": "run", "data": ")" + folder.write("run.csv", rows) +
      R"(", "time": "t", "channels": [{"column": "y", "sensor": "y_a", "sigma": 0.01}]}], "variables": ["k"]}})";
  const auto identified = [&](std::string text) {
    text.pop_back();
    return costs("identify", text + identification, {"--set", "parameters.m.allow_unused=true"});
  };
  const Costs alone = identified(one()), both = identified(two());
  for (const char* counter : {"steps", "rhs_evaluations", "factorisations", "factor_blocks"}) {
    INFO(counter);
    CHECK(both.counter(counter) == alone.counter(counter));
    CHECK(both.counter(counter) > 0);
  }
  CHECK(both.result.at("parameters") == alone.result.at("parameters"));
  CHECK(both.result.at("model").at("left_out") == nlohmann::json{"b"});
  CHECK_THAT(both.out, Contains("no measurement depends on them: b"));
}

TEST_CASE("blocks of derivatives are counted: one more for a force that the state changes, none for a constant one",
          "[costs]") {
  const auto blocks = [](const std::string& more_forces) {
    return costs("gradient", scene(body("a", "0"), pin("a", "0"), spring("a", "0") + more_forces, sensor("a"), kEnd));
  };
  const Costs without = blocks("");
  const long states = without.counter("linearised_states");
  CHECK(without.counter("derivative_blocks") == 3 * states);  // the body, its pin, its spring
  const Costs constant =
      blocks(R"(, {"name": "weight", "type": "force", "body": "a", "point": [0.5, 0, 0], "components": [0, -3, 0]})");
  CHECK(constant.counter("derivative_blocks") == without.counter("derivative_blocks"));
  CHECK(constant.gradient() != without.gradient());
  const Costs turning =
      blocks(R"(, {"name": "weight", "type": "force", "body": "a", "point": "tip", "components": [0, -3, 0]})");
  CHECK(turning.counter("derivative_blocks") == 4 * states);
  // What is no parameter is not differentiated: the stiffness alone instead of it and the mass.
  const Costs fixed =
      costs("gradient", one(), {"--set", "bodies[0].mass=2", "--set", "parameters.m.allow_unused=true"});
  CHECK(fixed.counter("differentiated_numbers") > 0);
  CHECK(fixed.counter("differentiated_numbers") < without.counter("differentiated_numbers"));
}

TEST_CASE("bodies that something connects with an objective stay", "[costs]") {
  const std::string rope =
      R"(, {"name": "rope", "type": "tsda", "body1": "a", "body2": "b", "point1": "tip", "point2": "tip",
          "stiffness": 1, "free_length": 4})";
  const std::string by_sensor =
      R"(, {"name": "push", "type": "force", "body": "a", "point": "tip", "components": [0, "0.1*y_b", 0]})";
  for (const std::string& connection : {rope, by_sensor}) {
    const Costs both = costs("gradient", two(connection));
    CHECK_FALSE(both.result.at("model").contains("left_out"));
    CHECK(both.counter("factor_blocks") > costs("gradient", one()).counter("factor_blocks"));
  }
  const Costs looked_at = costs("gradient", two("", R"("end": {"terminal": "y_a"}, "other": {"terminal": "y_b"})"));
  CHECK_FALSE(looked_at.result.at("model").contains("left_out"));
  CHECK(looked_at.gradient("other").at("k").get<double>() != 0);
}

TEST_CASE("a force that no parameter changes costs no factor and no linearised state", "[costs]") {
  const std::string constant =
      R"({"name": "weight", "type": "force", "body": "a", "point": "tip", "components": [0, -3, 0]})";
  const std::string without = scene(body("a", "0"), pin("a", "0"), spring("a", "0"), sensor("a"), kEnd);
  const std::string with = scene(body("a", "0"), pin("a", "0"), spring("a", "0") + "," + constant, sensor("a"), kEnd);
  for (const char* command : {"simulate", "gradient"}) {
    const Costs fewer = costs(command, without), more = costs(command, with);
    for (const char* counter : kCounters) {
      INFO(command << ", " << counter);
      CHECK(more.counter(counter) == fewer.counter(counter));
    }
    CHECK(more.result.at("objectives").at("end").at("value") != fewer.result.at("objectives").at("end").at("value"));
  }
}

TEST_CASE("a simulation has all bodies, and derives nothing", "[costs]") {
  const Costs both = costs("simulate", two());
  CHECK(both.counter("linearised_states") == 0);
  CHECK(both.counter("factor_blocks") > costs("simulate", one()).counter("factor_blocks"));
}

TEST_CASE("further objectives share the forward pass and the linearisations of the first", "[costs]") {
  const Costs first = costs("gradient", one(), {"--method", "adjoint"});
  const Costs all = costs(
      "gradient", one(std::string(kEnd) + R"(, "track": {"running": "(y_a + 0.5)^2"}, "third": {"running": "y_a^3"})"),
      {"--method", "adjoint"});
  for (const char* counter : kCounters) {
    INFO(counter);
    CHECK(all.counter(counter) == first.counter(counter));
  }
  CHECK(all.gradient() == first.gradient());
}
