#include "core/watch/pulse_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/expression/time_parts.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

constexpr double kShareOfLaw =
    0.02;  // of E: a law is smooth but for its pulses, so more doubts than of records cost little
constexpr std::size_t kFewest = 3;  // instants: fewer bound no pulse

// The slope of the parabola through three samples, at the middle one; at ends that of the line.
double slope_at(const std::vector<double>& x, const std::vector<double>& y, std::size_t i) {
  const auto secant = [&](std::size_t k) { return (y[k + 1] - y[k]) / (x[k + 1] - x[k]); };
  if (i == 0 || i + 1 == x.size()) return secant(i == 0 ? 0 : i - 1);
  const double h0 = x[i] - x[i - 1], h1 = x[i + 1] - x[i];
  return (h1 * secant(i - 1) + h0 * secant(i)) / (h0 + h1);
}

}  // namespace

std::vector<QuadratureNode> pulse_nodes(const Method& method) {
  std::vector<int> node_of;
  std::vector<QuadratureNode> nodes = quadrature_nodes(method.nodes, method.node_c, method.node_b, node_of);
  if (!method.gamma) return nodes;
  for (QuadratureNode& node : nodes) node.e = 0;
  for (QuadratureNode& stage : quadrature_nodes(method.stages, method.c, method.b, node_of))
    stage.b = 0, nodes.push_back(stage);
  return nodes;
}

PulseWatch::PulseWatch(const Mechanism& mechanism, double start, double end, std::vector<QuadratureNode> nodes)
    : nodes_(std::move(nodes)) {
  const MechanismData& d = mechanism.data();
  parameters_ = static_cast<int>(d.rho.size());
  inputs_.assign(d.rho.begin(), d.rho.end());
  for (std::size_t k = 0; k < d.kinks.size(); ++k) {
    if (d.kinks[k].curve->x().size() < kFewest) continue;
    functions_.push_back({{static_cast<int>(k), -1, 0, 0}, {}, 0, d.kinks[k].curve, d.kinks[k].delay, {}, {}});
  }
  d.forces->for_each([&]<class Kind>(const Kind& f) {
    if constexpr (HasLaw<Kind>)
      if (f.law.program) add_parts(*f.law.program, parameters_ + 2, f.force, start, end);
  });
  for (const AppliedForce& f : d.applied)
    for (const Program& component : f.components) add_parts(component, parameters_, f.force, start, end);
}

void PulseWatch::add_parts(const Program& program, int time, int force, double start, double end) {
  inputs_.resize(std::max(inputs_.size(), static_cast<std::size_t>(time) + 1), 0.0);
  for (Program& part : time_parts_of(program, parameters_, time)) {
    part.grow(scratch_);
    std::vector<double> pieces = pieces_of(part, time, inputs_, start, end);
    if (pieces.size() < kFewest) continue;
    functions_.push_back({{-1, force, 0, 0}, std::move(part), time, nullptr, 0, std::move(pieces), {}});
  }
}

double PulseWatch::value(const Function& f, double t) {
  if (f.curve) return f.curve->at(t - f.delay);
  inputs_[static_cast<std::size_t>(f.time)] = t;
  return f.part.value(inputs_, scratch_);
}

// Gauss's rule of two points, exact for cubics.
double PulseWatch::integral(const Function& f, double from, double to) {
  const double h = to - from, middle = 0.5 * (from + to), node = h / std::sqrt(12.0);
  return h <= 0 ? 0 : 0.5 * h * (value(f, middle - node) + value(f, middle + node));
}

// A piece of a spline counts as a cubic of Hermite with the slopes of parabolas: this reads each sample once.
void PulseWatch::integrate(Function& f) {
  f.integral.reserve(f.size());
  f.integral.push_back(0);
  for (std::size_t i = 0; i + 1 < f.size(); ++i) {
    double sum = 0;
    if (!f.curve) {
      sum = integral(f, f.pieces[i], f.pieces[i + 1]);
    } else {
      const std::vector<double>&x = f.curve->x(), &y = f.curve->y();
      const double h = x[i + 1] - x[i];
      const Interpolation how = f.curve->interpolation();
      sum = how == Interpolation::hold ? h * y[i] : 0.5 * h * (y[i] + y[i + 1]);
      if (how == Interpolation::spline) sum += h * h / 12 * (slope_at(x, y, i) - slope_at(x, y, i + 1));
    }
    f.integral.push_back(f.integral.back() + sum);
  }
}

double PulseWatch::integral_to(const Function& f, double t) {
  std::size_t low = 0, high = f.size();  // the last instant until t, or the first one
  while (high - low > 1) (f.t((low + high) / 2) <= t ? low : high) = (low + high) / 2;
  return t < f.t(0) ? -integral(f, t, f.t(0)) : f.integral[low] + integral(f, f.t(low), t);
}

void PulseWatch::look_at(Function& f, double t, double h, bool noticed) {
  while (f.next < f.size() && f.t(f.next) <= t) ++f.next;
  if (f.next + 1 >= f.size() || f.t(f.next + 1) >= t + h) return;  // no piece lies inside
  if (f.integral.empty()) integrate(f);
  double mean = 0, null = 0;
  for (const QuadratureNode& n : nodes_) {
    const double there = value(f, t + n.c * h);
    mean += n.b * there, null += n.e * there;
  }
  if (nodes_.size() == 1) null = 0;
  const double missed = std::abs(integral_to(f, t + h) - integral_to(f, t) - h * mean);
  const double share = f.curve ? 1 : kShareOfLaw;
  if (!(missed > (noticed ? share * h * std::abs(null) : f.largest))) return;
  const auto differs = [&](std::size_t i) {
    return std::abs(f.integral[i + 1] - f.integral[i] - mean * (f.t(i + 1) - f.t(i)));
  };
  std::size_t piece = f.next, last = f.next;
  for (; last + 1 < f.size() && f.t(last + 1) <= t + h; ++last)
    if (differs(last) > differs(piece)) piece = last;
  const double at = 0.5 * (f.t(piece) + f.t(piece + 1)), peak = value(f, at);
  double beside = t;
  for (std::size_t i = piece + 1; i <= last && beside == t; ++i)
    if (std::abs(value(f, f.t(i)) - mean) <= 0.5 * std::abs(peak - mean)) beside = f.t(i);
  const double change = std::abs(peak - value(f, beside));
  if (!(change > 0)) return;
  if (!noticed) f.largest = 2 * missed;
  f.pulse.t = at;
  doubts_.push_back({f.pulse, at, beside, missed / change});
}

const std::vector<PulseWatch::Doubt>& PulseWatch::doubts(double t, double h, bool noticed) {
  doubts_.clear();
  for (Function& f : functions_) look_at(f, t, h, noticed);
  return doubts_;
}

}  // namespace mbsopt
