// trajectory.csv: t, then per body  .x .y .z .e0 .e1 .e2 .e3 .vx .vy .vz .wx .wy .wz  (body-frame origin and its
// velocity, angular velocity, global components), then every sensor by name. Numbers have the fewest digits that read
// back as the same number.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/run/run.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::inline app {

struct Trajectory {
  std::vector<std::string> columns;       // as in the file's header
  std::vector<std::vector<double>> rows;  // one value per column
};

std::vector<double> column(const Trajectory& table, std::size_t index);

inline std::size_t sensor_column(const Scene& scene, std::size_t sensor) {
  return 1 + 13 * scene.bodies.size() + sensor;
}

// t and the columns of the bodies at one instant.
std::vector<double> body_columns(const Mechanism& mechanism, const StatePoint& at);

// A cell without a finite number is empty.
std::string to_csv(const Trajectory& trajectory);
// The same text; nothing if `go_on`, which gets the first number of each row, returns false.
std::optional<std::string> to_csv(const Trajectory& trajectory, const std::function<bool(double)>& go_on);

// A text as a cell of a CSV file. A comma, a quote or a line's end puts it in quotes (RFC 4180). An apostrophe precedes
// a text that a spreadsheet would run as a formula (OWASP, "CSV injection").
std::string csv_cell(std::string_view text);

}  // namespace mbsopt::inline app
