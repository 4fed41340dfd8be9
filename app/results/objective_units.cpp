#include "app/results/objective_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/expression/dimension_inference.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt::inline app {
namespace {

using Known = std::optional<Dimension>;  // nullopt: not known

class Dimensions {
 public:
  explicit Dimensions(const Scene& scene) : scene_(scene), facts_(scene) {}

  // Numbers are pure. If they cannot be, as in sin(5*t), they may have any dimension. Throws DimensionError if parts of
  // the expression still do not fit each other.
  Known of(const Expression& expression) const {
    const auto of_names = [this](const std::string& name) { return of_name(name); };
    try {
      return infer_dimension(expression, of_names, PlainNumbers::are_pure);
    } catch (const DimensionError&) {
      return infer_dimension(expression, of_names, PlainNumbers::fit_everything);
    }
  }

  Known of_name(const std::string& name) const {
    if (name == "t") return dimension::kTime;
    const Sensor* const sensor = facts_.sensor(name);
    if (!sensor) return facts_.dimension_of_name(name);
    const std::string unit = unit_in(scene_, *sensor);
    if (unit == "-") return dimension::kNone;
    const std::optional<Unit> known = parse_unit(unit);
    return known ? Known(known->dimension) : std::nullopt;
  }

 private:
  const Scene& scene_;
  SceneFacts facts_;
};

// The terms of a sum have one dimension: that of the known ones. Beside a term of unknown dimension a number may have
// any dimension.
Known dimension_of_sum(const std::vector<Known>& terms) {
  Known sum;
  bool has_unknown = false;
  for (const Known& term : terms) {
    if (!term)
      has_unknown = true;
    else if (!sum || sum->is_none())
      sum = term;
    else if (!term->is_none() && !compatible(*sum, *term))
      return std::nullopt;
  }
  return has_unknown && sum && sum->is_none() ? std::nullopt : sum;
}

Known product(const Known& a, const Known& b) { return a && b ? Known(*a * *b) : std::nullopt; }

Known dimension_of(const ObjectiveSpec& spec, const Dimensions& dimensions) {
  for (const std::optional<Expression>& mean : spec.means)
    if (mean) return dimensions.of(*mean);
  std::vector<Known> terms;
  if (spec.running) terms.push_back(product(dimensions.of(*spec.running), dimension::kTime));
  for (const std::optional<Expression>* term : {&spec.terminal, &spec.parameters_only})
    if (*term) terms.push_back(dimensions.of(**term));
  for (const ObjectiveSample& sample : spec.samples) terms.push_back(dimensions.of(sample.value));
  for (const TrackTerm& term : spec.track) {
    const Known sensor = dimensions.of_name(term.sensor);
    terms.push_back(product(dimensions.of(term.weight), product(sensor, sensor)));
  }
  return dimension_of_sum(terms);
}

std::string unit_of(const ObjectiveSpec& spec, const Dimensions& dimensions) {
  if (spec.is_written_in_cpp()) return "";
  if (spec.eigenvalue) return spec.eigenvalue->value.ends_with("frequency") ? "Hz" : "-";
  if (spec.frequency_response && spec.frequency_response->value == "phase") return "rad";
  if (spec.frequency_response) return "";
  try {
    const Known found = dimension_of(spec, dimensions);
    return !found ? "" : found->is_none() ? "-" : to_string(*found);
  } catch (const DimensionError&) {  // an objective may add what it likes
    return "";
  }
}

}  // namespace

ObjectiveUnits objective_units(const Problem& problem) {
  const Dimensions dimensions(problem.scene);
  ObjectiveUnits units;
  for (const ObjectiveSpec& spec : problem.objectives) units[spec.name] = unit_of(spec, dimensions);
  return units;
}

std::string shown_unit(const ObjectiveUnits& units, const std::string& objective) {
  const auto found = units.find(objective);
  return found == units.end() || found->second.empty() ? kUnknownUnit : found->second;
}

Json objective_json(double value, const std::optional<double>& true_value) {
  Json json{{"value", value}};
  if (true_value) json["true_value"] = *true_value;
  return json;
}

Json objectives_json(const std::vector<std::string>& names, const Eigen::VectorXd& psi,
                     std::span<const std::optional<double>> true_values, const std::vector<std::string>& parameters,
                     const Eigen::MatrixXd& psi_rho) {
  Json json = Json::object();
  for (Eigen::Index i = 0; i < psi.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    json[names[k]] = objective_json(psi(i), true_values[k]);
    if (!parameters.empty()) json[names[k]]["gradient"] = by_name(parameters, psi_rho.row(i));
  }
  return json;
}

std::string unit_of(const Json& quantity) { return quantity.value("unit", kUnknownUnit); }

std::string after_number(const Json& quantity) {
  const std::string unit = quantity.value("unit", "");
  return unit.empty() || unit == "-" ? "" : " " + unit;
}

std::string objective_line(const std::string& name, const Json& objective) {
  const Json extreme = objective.value("true_value", Json());
  return fmt::format("{} = {}{}{}\n", name, cell(objective.at("value"), 12), after_number(objective),
                     extreme.is_null() ? "" : fmt::format("   (true extreme: {})", cell(extreme, 10)));
}

Json objective_rows(const Json& result) {
  Json rows = Json::object();
  const auto add = [&](const Json& part, const std::string& load_case) {
    const Json objectives = part.value("objectives", Json::object());  // items() refers to it
    for (const auto& [name, objective] : objectives.items()) {
      Json& row = rows[name + load_case] = objective;
      row["unit"] = objective.contains("unit") ? objective["unit"] : Json(unit_of(rows.value(name, Json::object())));
      const double x = number_of(row, objective.contains("true_value") ? "true_value" : "value");
      const double margin = std::fmin(x - number_of(row, "lower"), number_of(row, "upper") - x);
      if (std::isfinite(margin)) row["margin"] = margin;
    }
  };
  add(result, "");
  const Json cases = result.value("cases", Json::object());
  for (const auto& [name, of_case] : cases.items()) add(of_case, fmt::format(" ({})", name));
  return rows;
}

TextTable objective_table(const Json& result) {
  return table_of(objective_rows(result),
                  {{"objective"}, {"value", "value", 10}, {"unit", "unit"}, {"true extreme", "true_value", 10, true}});
}

void add_units(Json& result, const ObjectiveUnits& units) {
  const auto add = [&](Json& part) {
    if (!part.contains("objectives")) return;
    for (auto& [name, objective] : part["objectives"].items())
      if (const auto unit = units.find(name); unit != units.end() && !unit->second.empty())
        objective["unit"] = unit->second;
  };
  add(result);
  if (result.contains("cases"))
    for (Json& of_case : result["cases"]) add(of_case);
}

// Power is effort times rate: the unit is N if the coordinate is a length, N m if it is an angle or a number.
std::string unit_of_effort(const Drive& drive) {
  return dimension_of_drive(drive.type, drive.coordinate) == dimension::kLength ? "N" : "N m";
}

std::string unit_in(const Scene& scene, const Sensor& sensor) {
  if (sensor.quantity == "force") {
    const auto force = std::ranges::find(scene.forces, sensor.force, &Force::name);
    if (force != scene.forces.end()) return std::holds_alternative<Tsda>(force->kind) ? "N" : "N m";
  }
  if (sensor.quantity == "drive_force") {
    const auto drive = std::ranges::find(scene.drives, sensor.drive, &Drive::name);
    if (drive != scene.drives.end()) return unit_of_effort(*drive);
  }
  return unit_of(scene, sensor);
}

}  // namespace mbsopt::inline app
