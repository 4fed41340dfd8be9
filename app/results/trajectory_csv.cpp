#include "app/results/trajectory_csv.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace mbsopt::inline app {

std::vector<double> column(const Trajectory& table, std::size_t index) {
  std::vector<double> values;
  values.reserve(table.rows.size());
  for (const std::vector<double>& row : table.rows) values.push_back(row[index]);
  return values;
}

std::vector<double> body_columns(const Mechanism& mechanism, const StatePoint& at) {
  std::vector<double> row{at.t};
  for (int body = 0; body < mechanism.bodies(); ++body) {
    const Eigen::Matrix<double, 13, 1> values = body_row(mechanism, body, at);
    row.insert(row.end(), values.begin(), values.end());
  }
  return row;
}

std::optional<std::string> to_csv(const Trajectory& trajectory, const std::function<bool(double)>& go_on) {
  std::string text;
  std::array<char, 32> number;  // the shortest text that reads back as the same double has 24 characters at most
  for (const std::string& column : trajectory.columns) text += (text.empty() ? "" : ",") + csv_cell(column);
  text += '\n';
  for (const std::vector<double>& row : trajectory.rows) {
    if (!row.empty() && !go_on(row.front())) return std::nullopt;
    for (std::size_t k = 0; k < row.size(); ++k) {
      if (k > 0) text += ',';
      if (std::isfinite(row[k])) text.append(number.data(), std::to_chars(number.begin(), number.end(), row[k]).ptr);
    }
    text += '\n';
  }
  return text;
}

std::string to_csv(const Trajectory& trajectory) {
  return *to_csv(trajectory, [](double) { return true; });
}

std::string csv_cell(std::string_view text) {
  const bool formula = !text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos;
  const std::string cell = (formula ? "'" : "") + std::string(text);
  if (cell.find_first_of(",\"\n\r") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

}  // namespace mbsopt::inline app
