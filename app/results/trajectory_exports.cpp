#include "app/results/trajectory_exports.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <set>

#include "app/results/objective_units.hpp"

namespace mbsopt::inline app {
namespace {

// Types of data elements, and the class of a matrix of doubles.
constexpr std::uint32_t kInt8 = 1, kInt32 = 5, kUint32 = 6, kDouble = 9, kMatrix = 14, kDoubleClass = 6;

template <class Number>
void append(std::string& bytes, Number value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

// Appends the type, the number of bytes, the bytes, and zeros up to a multiple of eight.
void append_element(std::string& bytes, std::uint32_t type, const std::string& content) {
  append(bytes, type);
  append(bytes, static_cast<std::uint32_t>(content.size()));
  bytes += content;
  bytes.append((8 - content.size() % 8) % 8, '\0');
}

std::string vector_element(const std::string& name, const std::string& values, std::size_t rows) {
  std::string flags, dimensions, element;
  append(flags, kDoubleClass);
  append(flags, std::uint32_t{0});
  append(dimensions, static_cast<std::int32_t>(rows));
  append(dimensions, std::int32_t{1});
  append_element(element, kUint32, flags);
  append_element(element, kInt32, dimensions);
  append_element(element, kInt8, name);
  append_element(element, kDouble, values);
  return element;
}

// Inside single quotes gnuplot reads '' as one quote, and all other characters literally.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

}  // namespace

std::vector<std::string> mat_names(const std::vector<std::string>& columns) {
  constexpr std::size_t kLongest = 63;  // namelengthmax of MATLAB
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (const std::string& column : columns) {
    std::string name = column;
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    const auto fits = [&](char c) { return letter(c) || (c >= '0' && c <= '9'); };
    std::ranges::replace_if(
        name, [&](char c) { return !fits(c); }, '_');
    if (name.empty() || !letter(name[0])) name.insert(0, "x");
    name.resize(std::min(name.size(), kLongest));
    const std::string stem = name;
    for (int k = 2; !taken.insert(name).second; ++k) {
      const std::string number = "_" + std::to_string(k);
      name = stem.substr(0, kLongest - number.size()) + number;
    }
    names.push_back(name);
  }
  return names;
}

std::string to_mat(const Trajectory& trajectory) {
  constexpr std::size_t kText = 116, kSubsystem = 8;  // bytes of the header, filled with blanks and zeros
  std::string bytes = "MATLAB 5.0 MAT-file, written by mbsopt";
  bytes.resize(kText, ' ');
  bytes.resize(kText + kSubsystem, '\0');
  append(bytes, std::uint16_t{0x0100});                                           // version
  append(bytes, static_cast<std::uint16_t>(('M' << 8) | static_cast<int>('I')));  // shows the order of bytes
  const std::vector<std::string> names = mat_names(trajectory.columns);
  for (std::size_t k = 0; k < names.size(); ++k) {
    std::string values;
    for (const std::vector<double>& row : trajectory.rows) append(values, row[k]);
    append_element(bytes, kMatrix, vector_element(names[k], values, trajectory.rows.size()));
  }
  return bytes;
}

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

}  // namespace mbsopt::inline app
