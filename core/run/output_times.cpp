#include "core/run/output_times.hpp"

#include <cmath>

namespace mbsopt {

std::vector<double> output_times(const SimulationSettings& settings) {
  constexpr int kDefaultIntervals = 200;
  const double span = settings.end_time - settings.start_time;
  const double step = settings.output_step.value_or(span / kDefaultIntervals);
  const double tolerance = 1e-9;  // of a step: 5/0.01 is not 500 in floating point
  const auto whole_steps = static_cast<long>(std::floor(span / step + tolerance));
  std::vector<double> times;
  times.reserve(static_cast<std::size_t>(whole_steps) + 2);
  for (long k = 0; k <= whole_steps; ++k) times.push_back(settings.start_time + static_cast<double>(k) * step);
  if (times.back() < settings.end_time - tolerance * step) {
    times.push_back(settings.end_time);
  } else {
    times.back() = settings.end_time;
  }
  return times;
}

}  // namespace mbsopt
