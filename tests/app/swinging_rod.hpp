// A rod on a spring that is to follow a sine: two parameters, and more than one minimum; and what runs of it leave.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "app/files/journal.hpp"
#include "app/terminal/exit_code.hpp"
#include "tests/app/run_command.hpp"

namespace mbsopt {

inline const char* const kSwingingRod = R"({
  "format": 1,
  "name": "rod",
  "gravity": [0, -9.81, 0],
  "parameters": {"k": {"value": 20, "lower": 5, "upper": 200, "scale": "log"},
                 "free": {"value": 0.5, "lower": 0.2, "upper": 1.2}},
  "bodies": [{"name": "rod", "mass": 2, "com": [0.5, 0, 0], "inertia": [1e-3, 0.1666, 0.1666],
              "points": {"tip": [1, 0, 0]}}],
  "joints": [{"name": "pin", "type": "revolute", "body1": "ground", "body2": "rod",
              "point1": [0, 0, 0], "point2": "O", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
  "forces": [{"name": "spring", "type": "tsda", "body1": "ground", "body2": "rod",
              "point1": [0, 1, 0], "point2": "tip", "stiffness": "k", "damping": 0.5, "free_length": "free"}],
  "sensors": {"tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"},
              "swing": {"quantity": "angle", "joint": "pin"},
              "speed": {"quantity": "rate", "joint": "pin"}},
  "simulation": {"end_time": 1, "output_step": 0.25},
  "objectives": {"track": {"running": "(tip_y + 0.2*sin(5*t))^2", "parameters_only": "1e-4*k"}},
  "design": {"minimize": "track", "variables": ["k", "free"],
             "multistart": {"starts": 8, "seed": 11}}
})";

// result.json without what says how it was run.
inline nlohmann::json outcome_of(const std::filesystem::path& folder) {
  nlohmann::json result = repeatable(json_of(folder / "result.json"));
  result.erase("provenance");
  if (result.contains("optimizer")) result["optimizer"].erase("simulations");  // of the last process
  return result;
}

inline std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::istringstream text(content_of(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

inline long journal_lines(const std::filesystem::path& folder, const std::string& key) {
  const auto lines = lines_of(folder / kJournalFile);
  return std::count_if(lines.begin(), lines.end(),
                       [&](const std::string& line) { return line.starts_with("{\"" + key + "\":"); });
}

// Half a second of the rod's motion at k = 20 and free = 0.5, told with little noise; from far away the fit has other
// minima.
inline std::string swing_csv(const TemporaryFolder& folder) {
  REQUIRE(run_command({"simulate", folder.write("truth.json", kSwingingRod), "--out", folder.file("truth"), "--set",
                       "simulation.output_step=0.05"})
              .exit_code == kDone);
  const std::vector<std::string> rows = lines_of(folder.path / "truth/trajectory.csv");
  std::string csv = "t,theta\n";
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const std::size_t last = rows[i].rfind(','), before = rows[i].rfind(',', last - 1);
    csv += rows[i].substr(0, rows[i].find(',')) + rows[i].substr(before, last - before) + "\n";
  }
  return csv;
}

inline std::string fit_problem() {
  std::string text = kSwingingRod;
  text.replace(text.find("\"k\": {\"value\": 20"), 17, "\"k\": {\"value\": 60");
  text.erase(text.find(",\n  \"design\""));
  return text + R"(,
  "identification": {"experiments": [{"name": "swing", "data": "swing.csv",
      "channels": [{"column": "theta", "sensor": "swing", "sigma": 0.01}]}], "variables": ["k", "free"],
      "multistart": {"starts": 5, "seed": 2}}})";
}

// The problem file, its record beside it.
inline std::string write_swing_fit(const TemporaryFolder& folder) {
  folder.write("swing.csv", swing_csv(folder));
  return folder.write("fit.json", fit_problem());
}

}  // namespace mbsopt
