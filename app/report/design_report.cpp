#include <fmt/format.h>

#include "app/report/mechanism_drawing.hpp"
#include "app/report/motion_plots.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {
namespace {

void add_parameters(HtmlPage& page, const Json& result) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, p] : result.at("parameters").items()) {
    rows.push_back({name, cell(p.at("initial")), cell(p.at("value")), cell(p.value("unit", Json())),
                    cell(p.value("lower", Json())), cell(p.value("upper", Json())), cell(p.value("at_bound", Json()))});
  }
  page.table({"parameter", "initial", "optimum", "unit", "lower", "upper", "at bound"}, rows);
}

void add_outcome(HtmlPage& page, const Json& result) {
  const Json& optimizer = result.at("optimizer");
  page.paragraph(fmt::format("{}: {}; {}, {}.", cell(optimizer.at("type")), cell(optimizer.at("message")),
                             counted(optimizer.at("iterations").get<long>(), "iteration"),
                             counted(optimizer.at("evaluations").get<long>(), "evaluation")));
  const Json cases = result.value("cases", Json::object());
  std::vector<std::vector<std::string>> rows;
  for (const auto& [name, objective] : result.at("objectives").items()) {
    rows.push_back({name, cell(objective.value("initial", Json())), cell(objective.at("value")),
                    cell(objective.value("lower", Json())), cell(objective.value("upper", Json())),
                    cell(objective.value("price", Json()))});
  }
  for (const auto& [load_case, of_case] : cases.items())
    for (const auto& [name, objective] : of_case.at("objectives").items())
      rows.push_back({fmt::format("{} ({})", name, load_case), cell(objective.value("initial", Json())),
                      cell(objective.at("value")), cell(objective.value("lower", Json())),
                      cell(objective.value("upper", Json())), cell(objective.value("price", Json()))});
  std::vector<std::string> header{"objective", "before", "after", "at least", "at most", "price"};
  if (has_true_values(result)) {
    header.push_back("true extreme after");
    std::size_t i = 0;
    for (const auto& [name, objective] : result.at("objectives").items())
      rows[i++].push_back(cell(objective.value("true_value", Json())));
    for (const auto& [load_case, of_case] : cases.items())
      for (const auto& [name, objective] : of_case.at("objectives").items())
        rows[i++].push_back(cell(objective.value("true_value", Json())));
  }
  page.table(header, rows);
  if (!result.contains("conflicts")) return;
  page.paragraph("These limits and bounds are in conflict:");
  std::vector<std::vector<std::string>> conflicts;
  for (const Json& c : result["conflicts"])
    conflicts.push_back({cell(c.at("limit")), cell(c.at("missed")), cell(c.at("price"))});
  page.table({"limit", "missed by", "price"}, conflicts);
}

void add_drawings(HtmlPage& page, const Scene& scene, const Eigen::VectorXd& rho, const Trajectory& before,
                  const Trajectory& after) {
  if (before.rows.empty()) return;
  const std::array<int, 2> plane = plane_of_motion(scene, before);
  if (after.rows.empty()) {
    page.drawing(mechanism_drawing("Before, at start and end", plane,
                                   {{"start", scene, before.rows.front()}, {"end", scene, before.rows.back()}}));
    return;
  }
  const Scene designed = with_values(scene, rho);
  page.drawing(mechanism_drawing("At the start", plane,
                                 {{"before", scene, before.rows.front()}, {"after", designed, after.rows.front()}}));
  page.drawing(mechanism_drawing("At the end", plane,
                                 {{"before", scene, before.rows.back()}, {"after", designed, after.rows.back()}}));
}

}  // namespace

std::string design_report(const Scene& scene, const Eigen::VectorXd& rho, const Json& result, const Trajectory& history,
                          const Trajectory& before, const Trajectory& after) {
  HtmlPage page(report_title(result));
  add_status(page, result);
  page.heading("Result");
  add_outcome(page, result);
  add_parameters(page, result);
  add_convergence(page, history);
  add_multistart(page, result);
  page.heading("Motion before and after");
  add_drawings(page, scene, rho, before, after);
  for (const LinePlot& plot : motion_plots(scene, before, after)) page.plot(plot);
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
