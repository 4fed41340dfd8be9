// A command run in this process, and a small problem to run it on.
#pragma once

#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "app/command/command_line.hpp"
#include "tests/app/temporary_folder.hpp"

namespace mbsopt {

struct CommandOutcome {
  int exit_code;
  std::string out, err;
};

inline CommandOutcome run_command(const std::vector<std::string>& arguments) {
  std::ostringstream out, err;
  const int exit_code = run_command_line(arguments, out, err);
  return {exit_code, out.str(), err.str()};
}

inline nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(content_of(file)); }

// result.json without what may differ from run to run.
inline nlohmann::json repeatable(nlohmann::json value) {
  if (value.is_object()) value.erase("wall_seconds");
  for (auto& element : value) {
    if (element.is_structured()) element = repeatable(element);
  }
  return value;
}

// A rod that swings about z from the horizontal, held by a spring; one degree of freedom.
inline const char* const kPendulum = R"({
  "format": 1,
  "name": "rod",
  "gravity": [0, -9.81, 0],
  "parameters": {"L": {"value": 1, "lower": 0.5, "upper": 2, "unit": "m"}, "k": {"value": 20, "unit": "N/m"}},
  "bodies": [{"name": "rod", "mass": 2, "com": ["L/2", 0, 0], "inertia": [1e-3, "2 [kg]*L^2/12", "2 [kg]*L^2/12"],
              "points": {"tip": ["L", 0, 0]}}],
  "joints": [{"name": "pin", "type": "revolute", "body1": "ground", "body2": "rod",
              "point1": [0, 0, 0], "point2": "O", "axis1": [0, 0, 1], "axis2": [0, 0, 1]}],
  "forces": [{"name": "spring", "type": "tsda", "body1": "ground", "body2": "rod",
              "point1": [0, 1, 0], "point2": "tip", "stiffness": "k", "damping": 0, "free_length": 0.5}],
  "sensors": {"swing": {"quantity": "angle", "joint": "pin"},
              "tip_y": {"quantity": "position", "body": "rod", "point": "tip", "component": "y"}},
  "simulation": {"end_time": 1, "output_step": 0.25},
  "objectives": {"track": {"running": "tip_y^2"}, "end": {"terminal": "swing", "parameters_only": "L"}},
  "design": {"minimize": "track", "variables": ["k"], "optimizer": {"tolerance": 1e-8}}
})";

}  // namespace mbsopt
