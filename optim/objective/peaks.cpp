#include "optim/objective/peaks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/cvodes/cvodes.hpp"
#include "core/run/output_times.hpp"
#include "core/simulate/simulation.hpp"

namespace mbsopt::inline optim {
namespace {

// The values of side * x that were seen, in the order of time.
class SeenValues {
 public:
  void add(double t, double x) {
    if (std::isfinite(x)) points_.push_back({t, x});
  }

  // A point that no neighbour exceeds, with the top of the parabola through the three.
  struct Top {
    double t, x;  // of the parabola
    double t0, t1, t2, x1;
    double bound;  // a peak that three values do not resolve may rise to it
  };
  // The highest ones first. The ends of the run are tops if the value falls from there.
  std::vector<Top> tops() {
    std::ranges::stable_sort(points_, {}, &Point::t);
    const auto same = [](const Point& a, const Point& b) { return a.t == b.t; };
    points_.erase(std::unique(points_.begin(), points_.end(), same), points_.end());
    if (points_.empty()) return {{0, kLow, 0, 0, 0, kLow, kLow}};
    std::vector<Top> found;
    const std::size_t last = points_.size() - 1;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const auto [t1, x1] = points_[i];
      const double before = i > 0 ? points_[i - 1].x : kLow, after = i < last ? points_[i + 1].x : kLow;
      if (x1 < before || x1 < after || (x1 == before && x1 == after)) continue;
      if (i == 0 || i == last) {
        found.push_back({t1, x1, t1, t1, t1, x1, x1});
        continue;
      }
      found.push_back(parabola(points_[i - 1], points_[i], points_[i + 1]));
    }
    if (const auto [t, x] = points_[0]; found.empty()) found.push_back({t, x, t, t, t, x, x});  // it is constant
    std::ranges::stable_sort(found, std::greater(), &Top::x);
    return found;
  }

 private:
  static constexpr double kLow = -std::numeric_limits<double>::infinity();
  static constexpr double kRise = 4;  // times the rise to the middle value
  struct Point {
    double t, x;
  };

  // x = x1 + b s + c s^2,  s = t - t1
  static Top parabola(const Point& p0, const Point& p1, const Point& p2) {
    const double s0 = p0.t - p1.t, s2 = p2.t - p1.t;
    const double d0 = (p0.x - p1.x) / s0, d2 = (p2.x - p1.x) / s2;
    const double c = (d2 - d0) / (s2 - s0), b = d0 - c * s0;
    const double bound = p1.x + kRise * (p1.x - std::min(p0.x, p2.x));
    const double top = c < 0 ? std::clamp(-b / (2 * c), s0, s2) : 0;
    return {p1.t + top, p1.x + b * top + c * top * top, p0.t, p1.t, p2.t, p1.x, bound};
  }

  std::vector<Point> points_;
};

}  // namespace

std::vector<std::vector<Peak>> peaks(const std::vector<Watched>& watched, const Mechanism& mechanism,
                                     const SimulationSettings& settings, const StepSequence& steps,
                                     const std::function<bool(double t)>& progress) {
  // Integrated runs have dense output that their steps resolve: one look beside the tops gives their times to 1e-6 of a
  // step. Solved ones may have narrow peaks: their brackets are halved as often as a hundredth of the run needs for
  // 1e-4 of itself.
  constexpr int kLooks = 2, kHalvings = 14;
  constexpr double kBeside = 0.1;  // of the distance to the neighbours
  if (watched.empty()) return {};
  std::vector<SeenValues> curves(watched.size());
  Sampling sampling;
  sampling.times = output_times(settings);  // no row of a trajectory exceeds a true extreme
  for (std::size_t i = 0; i < steps.times.size(); ++i) {
    const double points = std::max(8.0, std::ceil(steps.sizes[i] / settings.integrator.max_step.value_or(INFINITY)));
    for (double j = 0; j < points; ++j) sampling.times.push_back(steps.times[i] + j * steps.sizes[i] / points);
  }
  sampling.observe = [&](std::size_t, const StatePoint& at) {
    for (std::size_t k = 0; k < watched.size(); ++k) curves[k].add(at.t, watched[k].side * watched[k].x->value(at));
  };
  // CVODES takes its own steps again.
  const RunOptions options{is_cvodes(settings.integrator.type) ? nullptr : &steps, progress};
  std::vector<std::vector<SeenValues::Top>> tops(watched.size());
  for (int look = 0;; ++look) {
    std::ranges::sort(sampling.times);
    sampling.times.erase(std::unique(sampling.times.begin(), sampling.times.end()), sampling.times.end());
    const SimulationResult run = simulate(mechanism, settings, {}, sampling, options);
    if (!run.ok()) return {};
    sampling.times.clear();
    const bool solved = run.statistics.solved;
    for (std::size_t k = 0; k < watched.size(); ++k) {
      tops[k] = curves[k].tops();
      const double largest = std::ranges::max(tops[k], {}, &SeenValues::Top::x1).x1, rtol = settings.integrator.rtol;
      for (std::size_t j = 0; j < tops[k].size(); ++j) {
        const SeenValues::Top& top = tops[k][j];
        if (top.t0 == top.t2) continue;  // an end of the run
        if (look + 1 < kLooks && j < kMostPeaks) {
          const double beside = kBeside * std::min(top.t1 - top.t0, top.t2 - top.t1);
          for (const double t : {std::max(top.t - beside, top.t0), top.t, std::min(top.t + beside, top.t2)})
            sampling.times.push_back(t);
        }
        if (solved && look < kHalvings && std::max(top.x, top.bound) > largest + rtol * std::abs(largest))
          for (const double t : {(top.t0 + top.t1) / 2, (top.t1 + top.t2) / 2, top.t}) sampling.times.push_back(t);
      }
    }
    if (sampling.times.empty()) break;
  }
  std::vector<std::vector<Peak>> found(watched.size());
  for (std::size_t k = 0; k < watched.size(); ++k) {
    tops[k].resize(std::min(tops[k].size(), kMostPeaks));
    for (const SeenValues::Top& top : tops[k]) found[k].push_back({top.t1, watched[k].side * top.x1, top.t});
    std::ranges::stable_sort(found[k], std::greater(), [&](const Peak& p) { return watched[k].side * p.value; });
  }
  return found;
}

}  // namespace mbsopt::inline optim
