// SI units of the values of objectives, from those of their sensors, parameters and the time.
//
//   objective_units(problem).at("path");   // "m^2" of samples of (x - 0.1)^2, "-" of a number
#pragma once

#include <map>
#include <string>

#include "app/files/result_json.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// The unit by the objective's name; empty if its parts do not determine it. Numbers without a unit count as pure.
using ObjectiveUnits = std::map<std::string, std::string>;
ObjectiveUnits objective_units(const Problem& problem);

// Returns the unit for a table or an axis, or kUnknownUnit.
std::string shown_unit(const ObjectiveUnits& units, const std::string& objective);

// " m^2 s" to follow a value; empty for a number or an unknown unit.
std::string after_value(const ObjectiveUnits& units, const std::string& objective);

// Adds "unit" to each objective of a result and of its load cases whose unit is known.
void add_units(Json& result, const ObjectiveUnits& units);

}  // namespace mbsopt
