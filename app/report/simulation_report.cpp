#include "app/report/mechanism_drawing.hpp"
#include "app/report/motion_plots.hpp"
#include "app/report/report_parts.hpp"
#include "app/report/run_report.hpp"

namespace mbsopt {

std::string simulation_report(const Scene& scene, const Json& result, const Trajectory& trajectory) {
  HtmlPage page(report_title(result));
  add_status(page, result);
  add_objectives(page, result);
  page.heading("Motion");
  if (!trajectory.rows.empty()) {
    page.drawing(
        mechanism_drawing("The mechanism at start and end", plane_of_motion(scene, trajectory),
                          {{"start", scene, trajectory.rows.front()}, {"end", scene, trajectory.rows.back()}}));
  }
  for (const LinePlot& plot : motion_plots(scene, trajectory)) page.plot(plot);
  add_simulation(page, scene, result);
  add_model(page, result);
  add_provenance(page, result);
  return page.text();
}

}  // namespace mbsopt
