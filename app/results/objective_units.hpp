// Units in results, and objectives: their values, beside a smooth maximum or minimum the true one, their gradients, and
// their SI units, from those of their sensors, parameters and the time.
//
//   objective_units(problem).at("path");   // "m^2" of samples of (x - 0.1)^2, "-" of a number
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "app/terminal/text_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

inline constexpr const char* kUnknownUnit = "SI unit";  // is shown where a unit is not known

// The unit of a sensor in its scene: there a force or a drive acts along a line or about an axis.
std::string unit_in(const Scene& scene, const Sensor& sensor);

// Names the unit of the force or torque along a drive's coordinate.
std::string unit_of_effort(const Drive& drive);

// The unit by the objective's name; empty if its parts do not determine it. Numbers without a unit count as pure.
using ObjectiveUnits = std::map<std::string, std::string>;
ObjectiveUnits objective_units(const Problem& problem);

// Returns the unit for a table or an axis, or kUnknownUnit.
std::string shown_unit(const ObjectiveUnits& units, const std::string& objective);

Json objective_json(double value, const std::optional<double>& true_value);
// Those of all objectives by name; their gradients if there are parameters.
Json objectives_json(const std::vector<std::string>& names, const Eigen::VectorXd& psi,
                     std::span<const std::optional<double>> true_values,
                     const std::vector<std::string>& parameters = {}, const Eigen::MatrixXd& psi_rho = {});

// An entry of result["objectives"] or result["parameters"]: its unit, or kUnknownUnit.
std::string unit_of(const Json& quantity);
// " m^2 s" to follow its value; empty for a number or an unknown unit.
std::string after_number(const Json& quantity);
// "peak = 0.21 m   (true extreme: 0.213)", and the end of the line.
std::string objective_line(const std::string& name, const Json& objective);

// The objectives of a result and of its load cases, "peak" and "peak (cold)", as rows of a table. Each has a unit, and
// one with limits the margin to the nearer one, negative beyond it.
Json objective_rows(const Json& result);

template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& list) {
  std::vector<std::string> names;
  for (const Named& x : list) names.push_back(x.name);
  return names;
}

// {"k1": 0.3, "L01": 2.1}: the entries of a vector, such as a gradient, by name.
Json by_name(const std::vector<std::string>& names, const auto& values) {
  Json json = Json::object();
  for (std::size_t k = 0; k < names.size(); ++k) json[names[k]] = values(static_cast<Eigen::Index>(k));
  return json;
}

// objective, value, unit, and the true extreme of smooth ones
TextTable objective_table(const Json& result);

// Adds "unit" to each objective of a result and of its load cases whose unit is known.
void add_units(Json& result, const ObjectiveUnits& units);

}  // namespace mbsopt::inline app
