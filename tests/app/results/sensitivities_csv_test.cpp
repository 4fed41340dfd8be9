#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>

#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

using namespace mbsopt;
using Catch::Contains;

namespace {

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
};

Table table_of(const std::string& text) {
  Table table;
  std::istringstream lines(text);
  std::string line, cell;
  std::getline(lines, line);
  std::istringstream header(line);
  while (std::getline(header, cell, ',')) table.columns.push_back(cell);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    table.rows.emplace_back();
    while (std::getline(cells, cell, ',')) table.rows.back().push_back(std::stod(cell));
  }
  return table;
}

// Fixed steps: differences see the same discrete function as the tangent-linear model.
const std::vector<std::string> kFixedSteps{"--quiet", "--set",
                                           R"(simulation.integrator={"type": "rk4", "step": 0.01})"};

std::vector<std::string> with_fixed_steps(std::vector<std::string> arguments) {
  arguments.insert(arguments.end(), kFixedSteps.begin(), kFixedSteps.end());
  return arguments;
}

}  // namespace

TEST_CASE("sensitivities.csv holds what differences of trajectory.csv say, and the adjoint at the end", "[results]") {
  const TemporaryFolder folder;
  const std::string file = folder.write("rod.json", kPendulum);
  const auto run = [&](const std::string& name, std::vector<std::string> arguments) {
    arguments.insert(arguments.begin() + 1, {file, "--out", folder.file(name)});
    REQUIRE(run_command(with_fixed_steps(arguments)).exit_code == kDone);
  };
  run("base", {"simulate", "--sensitivities"});
  const Table table = table_of(content_of(folder.path / "base/sensitivities.csv"));
  CHECK(table.columns == std::vector<std::string>{"t", "d swing/d L", "d swing/d k", "d tip_y/d L", "d tip_y/d k"});
  REQUIRE(table.rows.size() == 5);
  run("plus", {"simulate", "--set", "parameters.k.value=20.001"});
  run("minus", {"simulate", "--set", "parameters.k.value=19.999"});
  const Table plus = table_of(content_of(folder.path / "plus/trajectory.csv"));
  const Table minus = table_of(content_of(folder.path / "minus/trajectory.csv"));
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    CHECK(table.rows[i][0] == plus.rows[i][0]);
    for (const auto& [sensor, column] : {std::pair<std::size_t, std::size_t>{14, 2}, {15, 4}}) {
      const double difference = (plus.rows[i][sensor] - minus.rows[i][sensor]) / 0.002;
      CHECK(table.rows[i][column] ==
            Approx(difference).epsilon(1e-7).margin(1e-9));  // their error, h^2 = 1e-6 of psi'''
    }
  }
  run("gradient", {"gradient", "--method", "adjoint"});
  const auto end = json_of(folder.path / "gradient/result.json").at("objectives").at("end").at("gradient");
  CHECK(table.rows.back()[2] == Approx(end.at("k").get<double>()).epsilon(1e-10));
  CHECK(table.rows.back()[1] == Approx(end.at("L").get<double>() - 1).epsilon(1e-10));  // its parameters_only is L
}

TEST_CASE("--sensitivities says what it lacks", "[results]") {
  const TemporaryFolder folder;
  const auto outcome_of = [&](const std::string& text) {
    return run_command({"simulate", folder.write("b.json", text), "--sensitivities", "--out", folder.file("out")});
  };
  const std::string body = R"("bodies": [{"name": "b", "mass": 1, "inertia": [1, 1, "J"]}])";
  const CommandOutcome no_sensors = outcome_of(R"({"parameters": {"J": 1}, )" + body + "}");
  CHECK(no_sensors.exit_code == kBadInput);
  CHECK_THAT(no_sensors.err, Contains("sensors: there are none"));
  const CommandOutcome no_parameters = outcome_of(
      R"({"definitions": {"J": 1}, "sensors": {"z": {"quantity": "position", "body": "b", "component": "z"}}, )" +
      body + "}");
  CHECK(no_parameters.exit_code == kBadInput);
  CHECK_THAT(no_parameters.err, Contains("parameters: there are none"));
  CHECK_FALSE(std::filesystem::exists(folder.path / "out/result.json"));
}
