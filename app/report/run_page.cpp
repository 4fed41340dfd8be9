#include "app/report/run_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/row_plot.hpp"
#include "app/results/objective_units.hpp"
#include "core/expression/counted.hpp"
#include "core/expression/dimension.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostCurves = 16;  // in one plot: each colour twice
constexpr const char* kBetween = "place between the bounds, on the scale of the parameter [-]";

// Writes rows "name, value" for the listed entries of an object.
struct Entry {
  const char* key;
  std::string label;
  int digits = 7;
};

void add_entries(HtmlPage& page, const Json& object, std::initializer_list<Entry> entries) {
  std::vector<TableRow> rows;
  for (const Entry& entry : entries) {
    if (object.contains(entry.key)) rows.push_back({entry.label, number_cell(object.at(entry.key), entry.digits)});
  }
  page.table({"", ""}, rows);
}

bool all_positive(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double v) { return v > 0; });
}

void add_provenance(HtmlPage& page, const Json& result) {
  page.heading("Where this comes from");
  const Json& origin = result.at("provenance");
  page.paragraph("The command that repeats this run:");
  page.code(cell(origin.at("command_line")));
  std::vector<TableRow> rows{{"sha256 of the problem file", cell(origin.at("input_sha256"))},
                             {"mbsopt", cell(result.at("version"))}};
  for (const auto& [name, version] : origin.at("libraries").items()) rows.push_back({name, cell(version)});
  page.table({"", ""}, rows);
}

// p dpsi/dp, the change of psi per relative change of p, largest first. A p of zero would hide the derivative.
void add_tornado(HtmlPage& page, const Scene& scene, const std::string& name, const Json& objective) {
  constexpr std::size_t kMost = 15;  // rows of one plot
  RowPlot plot{.title = name + ": what a change of each parameter does",
               .x_label = fmt::format("p dpsi/dp [{}]", unit_of(objective))};
  for (const Parameter& p : scene.parameters) {
    const double effect = p.value * number_of(objective.at("gradient"), p.name);
    if (std::isfinite(effect) && effect != 0)
      plot.rows.push_back({.name = p.name, .low = 0, .high = effect, .words = cell(effect, 4)});
  }
  const auto larger = [](const PlotRow& a, const PlotRow& b) { return std::abs(a.high) > std::abs(b.high); };
  std::stable_sort(plot.rows.begin(), plot.rows.end(), larger);
  const std::size_t all = plot.rows.size();
  if (all > kMost) plot.rows.resize(kMost);
  page.drawing(to_svg(plot));
  if (all > kMost) page.note(fmt::format("The {} largest of {} are drawn.", kMost, all));
}

}  // namespace

std::function<double(double value)> place_between_bounds(const Scene& scene, const std::string& name, const Json& p) {
  const double lower = number_of(p, "lower"), upper = number_of(p, "upper");
  if (!(upper > lower) || !std::isfinite(upper - lower)) return {};
  const auto parameter = std::ranges::find(scene.parameters, name.substr(name.rfind('.') + 1), &Parameter::name);
  if (parameter != scene.parameters.end() && parameter->scale != ParameterScale::linear)
    return [=](double value) { return std::log(value / lower) / std::log(upper / lower); };
  return [=](double value) { return (value - lower) / (upper - lower); };
}

std::vector<std::string> objective_values(const Json& objectives) {
  std::vector<std::string> values;
  for (const auto& [name, objective] : objectives.items())
    values.push_back(fmt::format("{} = {}{}", name, cell(objective.at("value"), 5), after_number(objective)));
  return values;
}

std::string unit_per(const std::string& unit, const std::string& divisor) {
  const auto dimension_of = [](const std::string& text) {
    return text == "-" ? std::optional(Unit{}) : parse_unit(text);
  };
  const std::optional<Unit> a = dimension_of(unit), b = dimension_of(divisor);
  if (!a || !b) return kUnknownUnit;
  const Dimension found = a->dimension / b->dimension;
  return found.is_none() ? "-" : to_string(found);
}

RunPage::RunPage(Run& its_run) : HtmlPage(its_run.problem.scene.name + ": " + its_run.context.command), run(its_run) {}

void RunPage::print(const TextTable& shown) { run.context.out << '\n' << shown.text(); }

void RunPage::both(const TextTable& shown) {
  print(shown);
  table(shown);
}

void RunPage::say(std::string_view words) {
  run.context.out << words << '\n';
  note(words);
}

void RunPage::write() {
  const Json& result = run.result;
  const std::string status = result.value("status", ""), message = result.value("message", "");
  if (status == "failed") {
    banner("This run failed: " + message);
    if (result.contains("last_good_time"))
      remark(fmt::format("The motion is good up to {:.6g} s.", result.at("last_good_time").get<double>()));
  } else if (status == "interrupted") {
    banner("This run was " + message + ".");
  }
  if (result.contains("accuracy")) remark("Accuracy: " + result.at("accuracy").at("in_words").get<std::string>());
  for (const Json& words : result.at("warnings")) warning(words.get<std::string>());
  if (result.contains("model")) {
    heading("Mechanism");
    add_entries(*this, result.at("model"),
                {{"bodies", "bodies"},
                 {"equations", "constraint equations"},
                 {"rank", "of rank"},
                 {"degrees_of_freedom", "degrees of freedom"},
                 {"redundant", "redundant"}});
  }
  add_provenance(*this, result);
  run.write("report.html", text());
}

void add_simulation(RunPage& page, const Scene& scene) {
  const Json& result = page.run.result;
  if (!result.contains("simulation")) return;
  page.heading("Simulation");
  add_entries(page, result.at("simulation"),
              {{"steps", "steps"},
               {"rejected", "rejected steps"},
               {"rhs_evaluations", "right-hand sides"},
               {"newton_iterations", "Newton iterations"},
               {"adjoint_memory_bytes", "kept for the adjoint [bytes]"},
               {"recomputed_steps", "steps computed again for it"},
               {"max_position_violation", "largest violation, positions", 2},
               {"max_velocity_violation", "largest violation, velocities", 2},
               {"energy_drift",
                conserves_energy(scene) ? "largest change of energy [J]"
                                        : fmt::format("largest change of energy [J], {}", kWorkIsDone),
                2}});
}

void add_objectives(RunPage& page) {
  const Json& result = page.run.result;
  if (!result.contains("objectives") || result.at("objectives").empty()) return;
  page.heading("Objectives");
  page.table(objective_table(result));
}

TextTable gradient_table(const Run& run) {
  const Json& objectives = run.result.at("objectives");
  std::vector<std::string> header{"parameter", "value", "unit"};
  for (const auto& [name, objective] : objectives.items())
    header.push_back(fmt::format("d {} [{} per unit]", name, unit_of(objective)));
  TextTable table(header);
  for (const Parameter& p : run.problem.scene.parameters) {
    TableRow& row = table.add({p.name, number_cell(p.value, 7), p.unit.empty() ? "-" : p.unit});
    for (const Json& objective : objectives)
      row.push_back(number_cell(objective.at("gradient").value(p.name, Json()), 12));
  }
  return table;
}

void add_gradients(RunPage& page) {
  page.heading("Gradients");
  page.table(gradient_table(page.run));
  for (const auto& [name, objective] : page.run.result.at("objectives").items())
    add_tornado(page, page.run.problem.scene, name, objective);
}

std::optional<PlotSeries> series_of(const Trajectory& table, const std::string& name, Mark mark) {
  const auto found = std::ranges::find(table.columns, name);
  if (found == table.columns.end() || table.rows.empty()) return std::nullopt;
  return PlotSeries{name, column(table, 0), column(table, static_cast<std::size_t>(found - table.columns.begin())),
                    mark};
}

void add_convergence(RunPage& page, const Trajectory& history, const std::string& unit) {
  if (history.rows.size() < 2) return;
  page.heading("Convergence");
  for (const char* name : {"objective", "cost", "infeasibility"}) {
    const std::optional<PlotSeries> series = series_of(history, name);
    if (!series || std::ranges::all_of(series->y, [](double v) { return v == 0; })) continue;
    page.plot({.title = name,
               .x_label = "iteration",
               .y_label = fmt::format("{} [{}]", name, name == std::string("objective") ? unit : "-"),
               .series = {*series},
               .logarithmic_y = all_positive(series->y),
               .whole_x = true});
  }
  // Shows values between two bounds, else relative to the start.
  LinePlot bounded{.title = "Parameters between their bounds",
                   .x_label = "iteration",
                   .y_label = kBetween,
                   .whole_x = true,
                   .limits = {{"lower bound", 0, false}, {"upper bound", 1, true}}};
  LinePlot free{.title = "Parameters", .x_label = "iteration", .y_label = "value/initial value [-]", .whole_x = true};
  for (const auto& [name, p] : page.run.result.at("parameters").items()) {
    std::optional<PlotSeries> series = series_of(history, name);
    if (!series) continue;
    const std::function<double(double)> between = place_between_bounds(page.run.problem.scene, name, p);
    const double initial = p.at("initial").get<double>();
    if (!between && initial == 0) continue;
    for (double& value : series->y) value = between ? between(value) : value / initial;
    (between ? bounded : free).series.push_back(*std::move(series));
  }
  for (const LinePlot& plot : {bounded, free})
    if (!plot.series.empty() && plot.series.size() <= kMostCurves) page.plot(plot);
}

// The starts of an identification compare sums of squares in sigma.
std::string minimised_unit(const Json& result) {
  const Json objectives = result.value("objectives", Json::object());
  return objectives.empty() ? "-" : unit_of(*objectives.begin());
}

const char* end_of_search(std::string_view status) {
  return status.starts_with("converged") ? "optimum" : "best point";
}

std::string counted_starts(const Json& multistart) {
  const long finished = multistart.at("finished").get<long>(), starts = multistart.at("starts").get<long>();
  return finished < starts ? fmt::format("{} of {}", finished, counted(starts, "start"))
                           : "all " + counted(starts, "start");
}

std::string starts_in_words(const Json& multistart) {
  const long same = multistart.at("at_the_best_optimum").get<long>();
  const std::string starts = fmt::format("{}, seed {}", counted_starts(multistart), multistart.at("seed").get<long>());
  if (same > 0) return fmt::format("{}: {} at the best optimum", starts, same);
  if (multistart.at("best").is_null()) return starts + ": none could be evaluated";
  return fmt::format("{}: the best one has not converged to an optimum ({})", starts,
                     multistart.at("waterfall").at(0).at("status").get<std::string>());
}

void add_multistart(RunPage& page) {
  const Json& result = page.run.result;
  if (!result.contains("multistart") || !result.at("multistart").contains("waterfall")) return;
  const Json& multistart = result.at("multistart");
  page.heading("Starts");
  page.paragraph(starts_in_words(multistart) + ".");
  LinePlot plot{.title = "Waterfall",
                .x_label = "rank",
                .y_label = fmt::format("objective [{}]", minimised_unit(result)),
                .whole_x = true};
  PlotSeries& series = plot.series.emplace_back(PlotSeries{"objective", {}, {}, Mark::points});
  for (const Json& record : multistart.at("waterfall")) {
    const double objective = number_of(record, "objective");
    if (std::isnan(objective)) continue;
    series.x.push_back(static_cast<double>(series.x.size() + 1));
    series.y.push_back(objective);
  }
  plot.logarithmic_y = all_positive(series.y);
  if (!series.y.empty()) page.plot(plot);
  std::vector<TableColumn> columns{{"start", "start"},
                                   {"objective", "objective", 6},
                                   {"infeasibility", "infeasibility", 2},
                                   {"optimality", "optimality", 2},
                                   {"outcome", "status"}};
  const Json parameters = result.value("parameters", Json::object());  // items() refers to it
  for (const auto& [name, p] : parameters.items()) columns.push_back({name, "parameters/" + name, 5, true});
  page.table(table_of(multistart.at("waterfall"), columns));
  const Json& optima = multistart.at("optima");
  if (optima.empty()) return;
  page.paragraph(fmt::format("Distinct optima: {}.", optima.size()));
  page.table(table_of(
      optima, {{"best start", "start"}, {"starts that ended there", "found_by"}, {"objective", "objective", 6}}));
}

}  // namespace mbsopt::inline app
