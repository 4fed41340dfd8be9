#include "core/scene/signals.hpp"

#include <algorithm>
#include <cmath>

namespace mbsopt {

Expression expression_of(const SampleColumn& samples, const std::string& name) {
  static const Expression t = Expression::parse("t");
  return samples.curve ? Expression::of_curve(samples.curve, t, name) : Expression(0.0);
}

Expression expression_of(const Signal& signal) {
  if (!signal.curve) return 0.0;
  const auto is = [](const Field& field, double value) { return field.is_number() && field.number() == value; };
  const Expression t = Expression::parse("t");
  Expression f = Expression::of_curve(signal.curve, is(signal.delay, 0) ? t : t - signal.delay, signal.name);
  if (!is(signal.gain, 1)) f = signal.gain * f;
  return is(signal.offset, 0) ? f : f + signal.offset;
}

void add_signals(Symbols& symbols, const Scene& scene) {
  for (const Signal& signal : scene.signals)
    if (symbols.input(signal.name) < 0 && !symbols.definition(signal.name))
      symbols.add_definition(signal.name, expression_of(signal));
}

std::size_t first_wrap(const std::vector<double>& values, double turn) {
  constexpr double kAbout = 0.1, kUnusual = 5;  // of a turn; of the median step
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(std::abs(values[i] - values[i - 1]));
  if (steps.size() < 2) return 0;
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  const auto wrap = std::ranges::find_if(
      steps, [&](double step) { return std::abs(step - turn) < kAbout * turn && step > kUnusual * *middle; });
  return wrap == steps.end() ? 0 : static_cast<std::size_t>(wrap - steps.begin()) + 1;
}

Covered covered_by(const Curve& samples, double delay) {
  const std::vector<double>& t = samples.x();
  const double beyond = samples.interpolation() == Interpolation::hold ? t.back() - t[t.size() - 2] : 0;
  return {t.front() + delay, t.back() + beyond + delay};
}

std::optional<std::string> uncovered(const Covered& samples, double start_time, double end_time) {
  const double slack = 1e-9 * (end_time - start_time);  // sums of sample intervals are rounded
  if (start_time >= samples.first - slack && end_time <= samples.last + slack) return std::nullopt;
  return "its samples cover " + Expression(samples.first).text() + " s to " + Expression(samples.last).text() +
         " s, the simulation " + Expression(start_time).text() + " s to " + Expression(end_time).text() + " s";
}

}  // namespace mbsopt
