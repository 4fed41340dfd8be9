#include "optim/objective/peaks.hpp"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/cvodes/cvodes.hpp"
#include "core/run/output_times.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt::inline optim {

namespace {

constexpr double kBeside = 1e-4;      // of the distance to the next point: where the value shows whether it rises
constexpr double kNear = 1.0 / 32;    // of that
constexpr std::uintmax_t kSlow = 12;  // iterations: parabolas find a smooth top in eight to ten, a kink takes 26

Peak with_slopes(Peak top, double rise, double drop, double apart) {
  if (rise > 0 && drop > 0) top.apart = apart, top.behind = rise / (rise + drop);
  return top;
}

}  // namespace

PeakWatch::PeakWatch(std::vector<Watched> watched, const SimulationSettings& settings, std::vector<double> further)
    : further_(std::move(further)), max_step_(settings.integrator.max_step.value_or(INFINITY)) {
  for (Watched& of : watched) curves_.push_back({std::move(of)});
}

Sampling PeakWatch::sampling() {
  for (Curve& curve : curves_) curve = {curve.of};
  next_ = 0;
  return {{}, {}, [this](const StepInside& step) { look(step); }};
}

std::vector<std::vector<Peak>> PeakWatch::peaks() const {
  std::vector<std::vector<Peak>> found;
  for (Curve curve : curves_) {
    if (curve.rose || curve.best.empty()) curve.add(curve.last);
    for (Peak& peak : curve.best) peak.value *= curve.of.side;
    found.push_back(std::move(curve.best));
  }
  return found;
}

void PeakWatch::Curve::add(const Peak& peak) {
  best.insert(std::ranges::upper_bound(best, peak.value, std::greater(), &Peak::value), peak);
  if (best.size() > kMostPeaks) best.pop_back();
}

void PeakWatch::look(const StepInside& step) {
  set_times(step);
  for (Curve& curve : curves_) curve.points.clear();
  for (const double t : times_) {
    const StatePoint at = step.state_at(t);
    for (Curve& curve : curves_)
      if (const double value = curve.value(at); std::isfinite(value)) curve.points.push_back({t, value});
  }
  for (Curve& curve : curves_) find_tops(curve, step);
}

void PeakWatch::set_times(const StepInside& step) {
  constexpr double kParts = 8;
  constexpr double kSame = 1e-6;  // of the step: values so near to each other differ by rounding only
  const double h = step.t1 - step.t0;
  times_.assign(step.solved.begin(), step.solved.end());
  if (static_cast<double>(step.solved.size()) <= kParts) {
    const double parts = std::max(kParts, std::ceil(h / max_step_));
    times_.clear();
    for (double j = 0; j < parts; ++j) times_.push_back(step.t0 + j * h / parts);
    times_.push_back(step.t1);
  }
  for (; next_ < further_.size() && further_[next_] <= step.t1; ++next_)
    if (further_[next_] > step.t0) times_.push_back(further_[next_]);
  std::ranges::sort(times_);
  const auto same = [&](double a, double b) { return b - a <= kSame * h; };
  times_.erase(std::unique(times_.begin(), times_.end(), same), times_.end());
}

void PeakWatch::find_tops(Curve& curve, const StepInside& step) {
  const std::vector<Peak>& p = curve.points;
  if (p.empty()) return;
  const auto beside = [&](const Peak& end, const Peak& next) {
    const double t = end.t + kBeside * (next.t - end.t);
    return Peak{t, curve.value(step.state_at(t))};
  };
  curve.last = p.back();
  if (p.size() == 1) return;
  if (p[0].value >= p[1].value) {
    if (const Peak inside = beside(p[0], p[1]); inside.value > p[0].value)
      refine(curve, p[0], inside, p[1], step);
    else if (curve.rose)
      curve.add(with_slopes(p[0], curve.slope, fall(curve, p[0], inside, step), kNear * (inside.t - p[0].t)));
  }
  for (std::size_t i = 1; i + 1 < p.size(); ++i) {
    const double before = p[i - 1].value, here = p[i].value, after = p[i + 1].value;
    if (here >= before && here >= after && !(here == before && here == after))
      refine(curve, p[i - 1], p[i], p[i + 1], step);
  }
  const Peak& left = p[p.size() - 2];
  curve.rose = curve.last.value > left.value;
  if (!curve.rose) return;
  const Peak inside = beside(curve.last, left);
  curve.slope = fall(curve, curve.last, inside, step);
  if (!(inside.value > curve.last.value)) return;
  curve.rose = false;
  refine(curve, left, inside, curve.last, step);
}

// The slope with which x falls from a top towards a point beside it, from there to twice the distance d: falls of
// a d + c d^2. It is 0 at a smooth top.
double PeakWatch::fall(const Curve& curve, const Peak& top, const Peak& beside, const StepInside& step) {
  const double d = beside.t - top.t, once = top.value - beside.value,
               twice = top.value - curve.value(step.state_at(top.t + 2 * d)), linear = (4 * once - twice) / 2;
  return once > 0 && linear > 0.5 * once ? linear / std::abs(d) : 0;
}

// The parabola x = x1 + b s + c s^2, s = t - t1, through three points tells how high the top may be. Points of a solved
// run may not resolve a narrow peak, which rises higher.
void PeakWatch::refine(Curve& curve, const Peak& left, const Peak& top, const Peak& right, const StepInside& step) {
  constexpr double kRise = 4;  // times the rise to the middle point
  constexpr int kBits = 18;    // of the bracket: the value at a smooth top is then exact to rounding
  const double s0 = left.t - top.t, s2 = right.t - top.t;
  const double d0 = (left.value - top.value) / s0, d2 = (right.value - top.value) / s2;
  const double c = (d2 - d0) / (s2 - s0), b = d0 - c * s0;
  double highest = c < 0 ? top.value - b * b / (4 * c) : top.value;
  if (!step.solved.empty())
    highest = std::max(highest, top.value + kRise * (top.value - std::min(left.value, right.value)));
  if (curve.best.size() == kMostPeaks && !(highest > curve.best.back().value)) return;
  const double middle = (left.t + right.t) / 2, half = (right.t - left.t) / 2;
  const auto instant = [&](double s) { return std::clamp(middle + s * half, left.t, right.t); };
  const auto depth = [&](double s) {
    const double value = curve.value(step.state_at(instant(s)));
    return std::isfinite(value) ? -value : std::numeric_limits<double>::max();
  };
  std::uintmax_t most = 60;  // Brent's method converges before
  const auto [s, lowest] = boost::math::tools::brent_find_minima(depth, -1.0, 1.0, kBits, most);
  Peak found = -lowest >= top.value ? Peak{instant(s), -lowest} : top;
  if (most >= kSlow) found = at_kink(curve, found, kBeside * (right.t - left.t), step);
  curve.add(found);
}

// Lines through two points on each side meet at a kink, but at a third of their rises above a smooth top. From near
// they are as good as exact.
Peak PeakWatch::at_kink(const Curve& curve, Peak top, double d, const StepInside& step) {
  for (int k = 0; k < 3; ++k, d *= kNear) {
    if (top.t - 2 * d < step.t0 || top.t + 2 * d > step.t1) break;
    const auto at = [&](double s) { return curve.value(step.state_at(top.t + s * d)); };
    const double before = at(-1), rise = before - at(-2), behind = at(1), drop = behind - at(2);
    const double s = (behind - before + drop - rise) / (rise + drop), height = before + rise * (s + 1);
    if (!(rise > 0 && drop > 0 && std::abs(s) < 1)) break;
    const Peak there{top.t + s * d, at(s)};
    if (height - there.value > 0.1 * (rise + drop)) break;
    top = with_slopes({there.t, std::max(top.value, there.value)}, rise, drop, d);
  }
  return top;
}

std::vector<std::vector<Peak>> peaks(const std::vector<Watched>& watched, const Mechanism& mechanism,
                                     const SimulationSettings& settings, const StepSequence& steps,
                                     const std::function<bool(double t)>& progress) {
  if (watched.empty()) return {};
  PeakWatch watch(watched, settings, output_times(settings));
  // CVODES takes its own steps again.
  const RunOptions options{is_cvodes(settings.integrator.type) ? nullptr : &steps, progress};
  if (!simulate(mechanism, settings, {}, watch.sampling(), options).ok()) return {};
  return watch.peaks();
}

}  // namespace mbsopt::inline optim
