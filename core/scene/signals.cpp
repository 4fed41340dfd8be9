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
  constexpr double kAgainst = 2.5;              // of the median step, where it goes against the steps beside it
  std::vector<double> steps, sizes;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  if (steps.size() < 2) return 0;
  for (const double step : steps) sizes.push_back(std::abs(step));
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::ranges::nth_element(sizes, middle);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double size = std::abs(steps[i]), off = std::abs(size - turn);
    const double beside = steps[i == 0 ? 1 : i - 1];
    // With few samples per turn a wrap is a turn less the step of the motion, which goes the other way.
    const bool against = steps[i] * beside < 0 && off < kAbout * turn + 1.5 * *middle && size > kAgainst * *middle;
    if (against || (off < kAbout * turn && size > kUnusual * *middle)) return i + 1;
  }
  return 0;
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
