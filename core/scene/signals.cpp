#include "core/scene/signals.hpp"

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
