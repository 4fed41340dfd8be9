#include "app/results/trajectory_gnuplot.hpp"

#include <fmt/format.h>

#include <cmath>

#include "app/results/sensor_unit.hpp"

namespace mbsopt {
namespace {

// Inside single quotes gnuplot reads '' as one quote, and all other characters literally.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

}  // namespace

std::string gnuplot_script(const Scene& scene) {
  const std::size_t kColumnsOfBody = 13, panels = scene.sensors.size() + scene.bodies.size();
  const auto rows = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(panels))));
  std::string script = fmt::format(
      "# gnuplot -persist trajectory.gp, in this folder; as a file:\n"
      "# gnuplot -e \"set terminal pdfcairo size 30cm,20cm; set output 'trajectory.pdf'\" trajectory.gp\n"
      "set termoption noenhanced\n"
      "set datafile separator comma\n"
      "set xlabel 't [s]'\n"
      "set grid\n"
      "set multiplot layout {},{} title {}\n",
      rows, (panels + rows - 1) / rows, quoted(scene.name));
  std::size_t column = 2 + kColumnsOfBody * scene.bodies.size();  // gnuplot counts from 1, and t is the first
  for (const Sensor& sensor : scene.sensors) {
    const std::string unit = unit_in(scene, sensor);
    script += fmt::format("set ylabel {}\nplot 'trajectory.csv' skip 1 using 1:{} with lines notitle\n",
                          quoted(unit.empty() ? sensor.name : fmt::format("{} [{}]", sensor.name, unit)), column++);
  }
  column = 2;
  for (const Body& body : scene.bodies) {
    script += fmt::format(
        "set ylabel {}\nplot 'trajectory.csv' skip 1 using 1:{} with lines title 'x', "
        "'' skip 1 using 1:{} with lines title 'y', '' skip 1 using 1:{} with lines title 'z'\n",
        quoted(body.name + " [m]"), column, column + 1, column + 2);
    column += kColumnsOfBody;
  }
  return script + "unset multiplot\n";
}

}  // namespace mbsopt
