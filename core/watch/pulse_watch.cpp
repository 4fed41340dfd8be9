#include "core/watch/pulse_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

constexpr double kShareOfLaw = 0.02;  // of E: a law is smooth but for its pulses, so more tests cost little
constexpr std::size_t kFewest = 3;    // instants: fewer bound no pulse

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
  for (QuadratureNode& stage : quadrature_nodes(method.stages, method.c, method.b, node_of)) {
    stage.b = 0;
    nodes.push_back(stage);
  }
  return nodes;
}

PulseWatch::PulseWatch(const Mechanism& mechanism, const SimulationSettings& settings, std::span<const Cost> costs,
                       std::vector<QuadratureNode> nodes)
    : rtol_(settings.integrator.rtol),
      span_(settings.end_time - settings.start_time),
      costs_(costs),
      nodes_(std::move(nodes)),
      inputs_(timed_inputs(mechanism)) {
  if (mechanism.data().needs_motion) motion_.emplace(mechanism, settings.formulation);
  const std::vector<KinkedSignal>& signals = mechanism.data().kinks;
  for (std::size_t k = 0; k < signals.size(); ++k)
    functions_.push_back({{.signal = static_cast<int>(k)}, {}, signals[k].curve, signals[k].delay, {}});
  for (TimedLaw& law : timed_laws(mechanism, costs, settings.start_time, settings.end_time)) {
    law.part.grow(scratch_);
    functions_.push_back({{.force = law.force, .drive = law.drive}, std::move(law), nullptr, 0, {}});
  }
  std::erase_if(functions_, [](const Function& f) { return f.size() < kFewest; });
}

std::vector<double> PulseWatch::jumps() const {
  std::vector<double> jumps;
  for (const Function& f : functions_) jumps.insert(jumps.end(), f.law.jumps.begin(), f.law.jumps.end());
  return jumps;
}

double PulseWatch::value(const Function& f, double t) {
  if (f.curve) return f.curve->at(t - f.delay);
  inputs_[static_cast<std::size_t>(f.law.time)] = t;
  return f.law.part.value(inputs_, scratch_);
}

// Gauss's rule of two points, exact for cubics.
PulseWatch::Integrals PulseWatch::integrals(const Function& f, double from, double to) {
  const double h = to - from, middle = 0.5 * (from + to), node = h / std::sqrt(12.0);
  if (h <= 0) return {};
  const double f0 = 0.5 * h * value(f, middle - node), f1 = 0.5 * h * value(f, middle + node);
  return {f0 + f1, middle * (f0 + f1) + node * (f1 - f0)};
}

// A piece of a spline counts as a cubic of Hermite with the slopes of parabolas: this reads each sample once.
void PulseWatch::integrate(Function& f) {
  f.until.reserve(f.size());
  Integrals sum;
  for (std::size_t i = 0; i < f.size(); ++i) {
    f.until.push_back(sum);
    if (i + 1 == f.size()) break;
    Integrals piece;
    if (!f.curve) {
      piece = integrals(f, f.t(i), f.t(i + 1));
    } else {
      const std::vector<double>&x = f.curve->x(), &y = f.curve->y();
      const double h = x[i + 1] - x[i];
      const Interpolation how = f.curve->interpolation();
      piece.f = how == Interpolation::hold ? h * y[i] : 0.5 * h * (y[i] + y[i + 1]);
      if (how == Interpolation::spline) piece.f += h * h / 12 * (slope_at(x, y, i) - slope_at(x, y, i + 1));
      piece.ft = 0.5 * (f.t(i) + f.t(i + 1)) * piece.f;
      if (how != Interpolation::hold) piece.ft += h * h / 12 * (y[i + 1] - y[i]);
    }
    sum.f += piece.f;
    sum.ft += piece.ft;
    f.of_size += std::abs(piece.f);
  }
}

PulseWatch::Integrals PulseWatch::integrals_to(const Function& f, double t) {
  std::size_t low = 0, high = f.size();  // the last instant until t, or the first one
  while (high - low > 1) (f.t((low + high) / 2) <= t ? low : high) = (low + high) / 2;
  const bool before = t < f.t(0);
  const Integrals rest = before ? integrals(f, t, f.t(0)) : integrals(f, f.t(low), t);
  const double sign = before ? -1 : 1;
  return {f.until[low].f + sign * rest.f, f.until[low].ft + sign * rest.ft};
}

PulseWatch::Candidate PulseWatch::candidate(Function& f, double t, double h, bool noticed) {
  while (f.next < f.size() && f.t(f.next) <= t) ++f.next;
  if (f.next + 1 >= f.size() || f.t(f.next + 1) >= t + h) return {};  // no piece lies inside
  if (f.until.empty()) integrate(f);
  double mean = 0, so_far = 0, null = 0;
  for (const QuadratureNode& n : nodes_) {
    const double there = value(f, t + n.c * h);
    mean += n.b * there;
    so_far += n.b * (1 - n.c) * there;
    null += n.e * there;
  }
  if (nodes_.size() == 1) null = 0;
  const Integrals i0 = integrals_to(f, t), i1 = integrals_to(f, t + h);
  const double at_end = std::abs(i1.f - i0.f - h * mean);
  const double in_mean = std::abs(((t + h) * (i1.f - i0.f) - (i1.ft - i0.ft)) / h - h * so_far);
  const double missed = std::max(at_end, in_mean), seen = h * std::abs(null);
  if (!(noticed ? at_end > (f.curve ? 1 : kShareOfLaw) * seen || in_mean > seen : missed > f.largest)) return {};
  const auto differs = [&](std::size_t i) {
    return std::abs((f.until[i + 1].f - f.until[i].f) / (f.t(i + 1) - f.t(i)) - mean);
  };
  std::size_t piece = f.next, last = f.next;
  for (; last + 1 < f.size() && f.t(last + 1) <= t + h; ++last)
    if (differs(last) > differs(piece)) piece = last;
  const double at = 0.5 * (f.t(piece) + f.t(piece + 1)), peak = value(f, at);
  double beside = t;
  for (std::size_t i = piece + 1; i <= last && beside == t; ++i)
    if (std::abs(value(f, f.t(i)) - mean) <= 0.5 * std::abs(peak - mean)) beside = f.t(i);
  const double change = std::abs(peak - value(f, beside));
  if (!(change > 0)) return {};
  if (!noticed) f.largest = 2 * missed;
  const bool is_cost = !f.curve && f.pulse.force < 0 && f.pulse.drive < 0;
  return {at, beside, missed / change, is_cost ? missed / f.of_size : 0};
}

// The largest error of a running cost [tolerances], if it is a thousandth of the integral or more: smaller ones would
// let a rough record, which is a row of pulses, ask for steps as short as its samples.
double PulseWatch::missed_by_costs(const Candidate& pulse, double t, const Eigen::VectorXd& y,
                                   const Eigen::VectorXd& angles) {
  constexpr double kLeast = 1e-3;
  double worst = 0;
  for (const Cost& cost : costs_) {
    if (!motion_ || !cost.running || cost.is_extreme) continue;
    const auto g = [&](double time) { return cost.running->value({time, y, angles, &*motion_}); };
    const double missed = std::abs(g(pulse.at) - g(pulse.beside)) * pulse.duration;
    worst = std::max(worst, missed / (std::abs(g(t)) * span_ + missed));
  }
  return worst > kLeast ? worst / rtol_ : 0;
}

Pulse PulseWatch::worst(double t, double h, bool noticed, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                        const Change& change) {
  Pulse worst;
  for (Function& f : functions_) {
    const Candidate d = candidate(f, t, h, noticed);
    if (!(d.duration > 0)) continue;
    const double error =
        d.share > 0 ? d.share / rtol_ : std::max(change(d.at, d.beside, d.duration), missed_by_costs(d, t, y, angles));
    if (!(error > worst.error)) continue;
    worst = f.pulse;
    worst.t = d.at;
    worst.error = error;
  }
  return worst;
}

}  // namespace mbsopt
