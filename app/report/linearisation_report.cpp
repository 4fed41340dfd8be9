#include <fmt/format.h>

#include "app/report/mechanism_drawing.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"

namespace mbsopt {

std::string linearisation_report(const Scene& scene, const Json& result, const std::vector<double>& state,
                                 const std::vector<std::vector<double>>& shapes) {
  constexpr std::size_t kDrawn = 12;  // modes that a reader still tells apart
  HtmlPage page(report_title(result));
  add_status(page, result);
  const Json& modes = result.at("linearisation").at("modes");
  page.heading("Modes");
  std::vector<std::vector<std::string>> rows;
  for (const Json& m : modes) {
    const Json& lambda = m.at("eigenvalue");
    rows.push_back({std::to_string(rows.size() + 1), cell(m.at("moves_most")), cell(m.at("frequency"), 6),
                    cell(m.at("damping_ratio"), 4), cell(lambda.at(0), 6), cell(lambda.at(1), 6)});
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
