#include "app/run/sweep_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "optim/problem/csv_table.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/start_points.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostPoints = 10'000'000;  // of a grid: more is an input error, and fills the memory

template <class... Arguments>
[[noreturn]] void refuse(fmt::format_string<Arguments...> words, Arguments&&... arguments) {
  throw std::invalid_argument(fmt::format(words, std::forward<Arguments>(arguments)...));
}

int parameter_index(const Scene& scene, const std::string& name) { return parameter_indices(scene, {name}).front(); }

double number_in(const std::string& text, const std::string& option) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
    refuse("--vary {}: '{}' is not a number", option, text);
  return value;
}

struct VariedRange {
  Parameter parameter;  // with its ends as bounds
  int index = 0;
  std::size_t count = 0;  // 0: not said
};

VariedRange range_of(const Scene& scene, const std::string& option) {
  std::vector<std::string> parts;  // NAME, LOW, HIGH, COUNT
  std::istringstream words(option);
  for (std::string part; std::getline(words, part, parts.empty() ? '=' : ':');) parts.push_back(part);
  if (parts.size() < 3 || parts.size() > 4 || option.ends_with(':'))
    refuse("--vary {}: is not NAME=LOW:HIGH or NAME=LOW:HIGH:COUNT", option);
  VariedRange range;
  range.index = parameter_index(scene, parts[0]);
  range.parameter = scene.parameters[static_cast<std::size_t>(range.index)];
  const double low = number_in(parts[1], option), high = number_in(parts[2], option);
  if (!(low < high)) refuse("--vary {}: {} is not below {}", option, low, high);
  if (range.parameter.scale != ParameterScale::linear && !(low > 0))
    refuse("--vary {}: the scale of '{}' is logarithmic, so its values are above 0", option, range.parameter.name);
  range.parameter.lower = low;
  range.parameter.upper = high;
  if (parts.size() == 4) {
    const double count = number_in(parts[3], option);
    if (!(count >= 2 && count <= static_cast<double>(kMostPoints)) || count != std::floor(count))
      refuse("--vary {}: {} is not a number of points; at least 2 are needed", option, parts[3]);
    range.count = static_cast<std::size_t>(count);
  }
  return range;
}

// The k-th of n values from end to end.
double grid_value(const VariedRange& range, std::size_t k) {
  const double low = *range.parameter.lower, high = *range.parameter.upper;
  if (k == 0) return low;
  if (k + 1 == range.count) return high;
  const double part = static_cast<double>(k) / static_cast<double>(range.count - 1);
  return range.parameter.scale == ParameterScale::linear ? low + part * (high - low) : low * std::pow(high / low, part);
}

std::vector<Eigen::VectorXd> grid(const std::vector<VariedRange>& ranges) {
  std::size_t total = 1;
  for (const VariedRange& range : ranges) {
    if (range.count == 0)
      refuse("--vary {}=LOW:HIGH: gives no number of points; write LOW:HIGH:COUNT, or use --samples for all",
             range.parameter.name);
    total *= range.count;
    if (total > kMostPoints) refuse("--vary: the grid has more than {} points", kMostPoints);
  }
  std::vector<Eigen::VectorXd> points;
  points.reserve(total);
  for (std::size_t point = 0; point < total; ++point) {
    Eigen::VectorXd values(static_cast<Eigen::Index>(ranges.size()));
    std::size_t rest = point;
    for (std::size_t i = ranges.size(); i-- > 0; rest /= ranges[i].count)
      values(static_cast<Eigen::Index>(i)) = grid_value(ranges[i], rest % ranges[i].count);
    points.push_back(std::move(values));
  }
  return points;
}

SweepPoints rows_of(const Scene& scene, const std::string& file) {
  const CsvTable table = read_csv(file);
  SweepPoints points;
  for (const std::string& name : table.header) points.parameters.push_back(parameter_index(scene, name));
  if (table.rows() == 0) throw CsvError(table.name + ": has no rows");
  for (std::size_t row = 0; row < table.rows(); ++row) {
    Eigen::VectorXd values(static_cast<Eigen::Index>(table.columns.size()));
    for (std::size_t k = 0; k < table.columns.size(); ++k) {
      const double value = table.columns[k][row];
      if (!std::isfinite(value))
        throw CsvError(fmt::format("{}: column '{}' has no number here", table.place(row), table.header[k]));
      values(static_cast<Eigen::Index>(k)) = value;
    }
    points.values.push_back(std::move(values));
  }
  return points;
}

}  // namespace

SweepPoints sweep_points(const Scene& scene, const SweepOptions& options, long seed) {
  if (options.points.empty() == options.vary.empty())
    refuse("sweep needs either --vary NAME=LOW:HIGH:COUNT, once or more, or --points FILE.csv");
  if (!options.points.empty()) {
    if (options.samples) refuse("--samples: are taken within --vary, not from --points");
    return rows_of(scene, options.points);
  }
  std::vector<VariedRange> ranges;
  SweepPoints points;
  for (const std::string& option : options.vary) {
    ranges.push_back(range_of(scene, option));
    if (std::ranges::find(points.parameters, ranges.back().index) != points.parameters.end())
      refuse("--vary {}: '{}' is varied twice", option, ranges.back().parameter.name);
    points.parameters.push_back(ranges.back().index);
  }
  if (!options.samples) {
    points.values = grid(ranges);
    return points;
  }
  if (static_cast<std::size_t>(*options.samples) > kMostPoints)
    refuse("--samples: {} are more than {} points", *options.samples, kMostPoints);
  std::vector<Parameter> parameters;
  for (const VariedRange& range : ranges) {
    if (range.count > 0) refuse("--vary of '{}': has a number of points, and so has --samples", range.parameter.name);
    parameters.push_back(range.parameter);
  }
  points.values = start_values(parameters, {*options.samples + 1, seed, StartSampling::latin_hypercube}, seed);
  points.values.erase(points.values.begin());  // the given values
  return points;
}

}  // namespace mbsopt::inline app
