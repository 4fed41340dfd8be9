// The sections that reports of several commands share.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/files/result_json.hpp"
#include "app/report/html_page.hpp"
#include "app/report/motion_scene.hpp"
#include "app/results/trajectory_csv.hpp"

namespace mbsopt::inline app {

// "m^2 s"; kUnknownUnit if the unit of an objective, an entry of result["objectives"], is unknown.
std::string unit_of(const Json& objective);
std::string after_number(const Json& quantity);  // " m^2 s": its "unit", where it has one and is no number
std::vector<std::string> objective_values(const Json& objectives);          // "path = 1.23 m^2 s", ...
std::string unit_per(const std::string& unit, const std::string& divisor);  // "N/m", "m" to "N/m^2"
std::string report_title(const Json& result);                               // "five_bar: design"
void add_status(HtmlPage& page, const Json& result);  // a banner where it did not end well; warnings
void add_simulation(HtmlPage& page, const Scene& scene, const Json& result);  // steps, violations, energy
void add_objectives(HtmlPage& page, const Json& result);                      // name and value
// Returns whether any objective is a smooth maximum or minimum, with the true one beside it.
bool has_true_values(const Json& result);
// Adds objective, infeasibility and parameters over iterations. parameters has the form of result.json, by the names of
// columns. unit is that of the objective.
void add_convergence(HtmlPage& page, const Scene& scene, const Trajectory& history, const Json& parameters,
                     const std::string& unit = "-");
void add_multistart(HtmlPage& page, const Scene& scene, const Json& result);  // the waterfall, where there is one
// "all 10 starts" or "3 of 10 starts" of the entry "multistart".
std::string counted_starts(const Json& multistart);
// "all 10 starts, seed 7: 2 at the best optimum", "... : the best one has not converged (iteration_limit)".
std::string starts_in_words(const Json& multistart);
// "optimum" if the optimiser converged, else "best point": the end of its search. status: as in result.json.
const char* end_of_search(std::string_view status);

// The place of a value between the bounds of a parameter, from 0 to 1, by its logarithm if that is its scale.
struct Between {
  double lower = 0, upper = 1;
  bool logarithmic = false;
  double operator()(double value) const;
};
// None without two bounds. `name` may be "run1.k"; p is an entry of result["parameters"].
std::optional<Between> bounds_of(const Scene& scene, const std::string& name, const Json& p);
inline constexpr const char* kBetween = "place between the bounds, on the scale of the parameter [-]";

// The moving mechanism, above drawings of its start and end that replace it without a script.
void add_motion(HtmlPage& page, const std::vector<MovingState>& states);
void add_provenance(HtmlPage& page, const Json& result);
// Adds bodies, equations, degrees of freedom where the result has them, and the provenance. Returns the whole page.
std::string finished(HtmlPage& page, const Json& result);
// A rounded number that shows all its digits under the pointer, or a word.
TableCell number_cell(const Json& value, int digits = 6);
// A value with the digits that its standard error justifies: 20.13 for 20.1273 +- 0.05.
TableCell rounded_cell(const Json& value, const Json& error);
double number_of(const Json& object, const std::string& key);  // NaN if it is none
// A number, a word, an interval, or "-" for none.
std::string cell(const Json& value, int digits = 7);

}  // namespace mbsopt::inline app
