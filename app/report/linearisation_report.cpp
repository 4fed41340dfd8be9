#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/report/mechanism_drawing.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt {

namespace {

// "3 modes from 1.2 Hz to 8.4 Hz; the least damped has the damping ratio 0.012, all decay."
void add_modes_verdict(HtmlPage& page, const Json& modes) {
  if (modes.empty()) return;
  double slowest = INFINITY, fastest = 0, growth = -INFINITY, damping = INFINITY;
  for (const Json& m : modes) {
    const double f = m.at("frequency").get<double>();
    slowest = std::min(slowest, f), fastest = std::max(fastest, f);
    growth = std::max(growth, m.at("eigenvalue").at(0).get<double>());
    damping = std::min(damping, m.at("damping_ratio").get<double>());
  }
  page.verdict(
      fmt::format("{} from {:.4g} Hz to {:.4g} Hz; the least damping ratio is {:.3g} and the largest real part "
                  "of an eigenvalue {:.3g} 1/s.",
                  counted(static_cast<long>(modes.size()), "mode"), slowest, fastest, damping, growth));
}

}  // namespace

std::string linearisation_report(const Scene& scene, const Json& result, const std::vector<double>& state,
                                 const std::vector<std::vector<double>>& shapes) {
  constexpr std::size_t kDrawn = 12;  // modes that a reader still tells apart
  HtmlPage page(report_title(result));
  const Json& modes = result.at("linearisation").at("modes");
  add_modes_verdict(page, modes);
  add_status(page, result);
  page.heading("Modes");
  std::vector<TableRow> rows;
  for (const Json& m : modes) {
    const Json& lambda = m.at("eigenvalue");
    rows.push_back({std::to_string(rows.size() + 1), cell(m.at("moves_most")), number_cell(m.at("frequency"), 6),
                    number_cell(m.at("damping_ratio"), 4), number_cell(lambda.at(0), 6), number_cell(lambda.at(1), 6)});
  }
  page.table({"mode", "moves most", "frequency [Hz]", "damping ratio", "Re lambda [1/s]", "Im lambda [1/s]"}, rows);
  for (std::size_t k = 0; k < std::min(shapes.size(), kDrawn); ++k) {
    const std::string title = fmt::format("Mode {}, {} Hz", k + 1, cell(modes[k].at("frequency"), 4));
    const std::array<int, 2> plane = plane_of_motion(scene, {trajectory_columns(scene), {state, shapes[k]}});
    page.drawing(mechanism_drawing(title, plane, {{"state", scene, state}, {"displaced", scene, shapes[k]}}));
  }
  if (shapes.size() > kDrawn) page.paragraph(fmt::format("The first {} of {} modes are drawn.", kDrawn, shapes.size()));
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
