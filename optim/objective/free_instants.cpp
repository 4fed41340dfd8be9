#include "optim/objective/free_instants.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/simulate/simulation.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr long kRows = 200;       // of output, when output_step is absent
constexpr long kMostRows = 2000;  // a curve with more minima than that is no path of a mechanism
// Last step of the secant method in parts of a bracket. It leaves less than a hundred-thousandth of itself.
constexpr double kSettled = 1e-7;
constexpr int kMostSteps = 30;  // halving alone makes a bracket a billionth of itself

std::vector<double> scan_times(const SimulationSettings& s) {
  const double span = s.end_time - s.start_time;
  const double rows = s.output_step ? std::ceil(span / *s.output_step) : static_cast<double>(kRows);
  const long n = static_cast<long>(std::clamp(rows, 4.0, static_cast<double>(kMostRows)));
  std::vector<double> times;
  for (long i = 0; i < n; ++i) times.push_back(s.start_time + span * static_cast<double>(i) / static_cast<double>(n));
  times.push_back(s.end_time);
  return times;
}

// A number and its derivative in time.
struct Moving {
  double value, rate;
};

// The cubic through values and rates at both ends of an interval of length h, at the part u of it.
Moving hermite(const Moving& a, const Moving& b, double h, double u) {
  const double d = b.value - a.value, p = h * a.rate, q = h * b.rate;
  const double c2 = 3 * d - 2 * p - q, c3 = p + q - 2 * d;
  return {a.value + u * (p + u * (c2 + u * c3)), (p + u * (2 * c2 + 3 * u * c3)) / h};
}

}  // namespace

// The channels at given times, one column per time.
struct FreeInstants::Motion {
  std::vector<double> times;
  MatrixXd s, s_t;
  VectorXd weights;
  Moving of(std::size_t channel, std::size_t time) const {
    const Index c = static_cast<Index>(channel), i = static_cast<Index>(time);
    return {s(c, i), s_t(c, i)};
  }
};

// Where D/2 of a point has a minimum: its rate is negative at `from` and positive at `to`, or both are one end of the
// run.
struct FreeInstants::Bracket {
  double from, to, tau;
  double square;                         // D/2 at tau
  double curvature;                      // of D/2
  double earlier = 0, earlier_rate = 0;  // tau before this one, and the rate of D/2 there
};

FreeInstants::FreeInstants(const SimulationSettings& settings) {
  settings_.start_time = settings.start_time, settings_.end_time = settings.end_time;
  settings_.output_step = settings.output_step;
  settings_.solve = Solve::kinematics;
}

std::size_t FreeInstants::point(const std::string& file, std::size_t row) {
  const auto found = std::ranges::find_if(points_, [&](const Point& p) { return p.row == row && p.file == file; });
  if (found != points_.end()) return static_cast<std::size_t>(found - points_.begin());
  points_.push_back({file, row, {}});
  return points_.size() - 1;
}

std::size_t FreeInstants::channel(const CostExpression& sensor, const CostExpression& weight) {
  channels_.push_back({sensor, weight});
  return channels_.size() - 1;
}

void FreeInstants::add(std::size_t point, std::size_t channel, double target) {
  points_[point].coordinates.push_back({channel, target});
}

FreeInstants::Motion FreeInstants::motion_at(const Mechanism& mechanism, const std::vector<double>& times,
                                             const std::function<bool(double t)>& progress) const {
  const Index n = static_cast<Index>(channels_.size()), half = mechanism.states() / 2;
  Motion motion{times, MatrixXd(n, times.size()), MatrixXd(n, times.size()), VectorXd(n)};
  std::vector<std::shared_ptr<const PointCost>> sensors, weights;
  for (const Channel& channel : channels_)
    sensors.push_back(channel.sensor.bind(mechanism)), weights.push_back(channel.weight.bind(mechanism));
  VectorXd y_bar(mechanism.states()), rho_bar(mechanism.rho().size());
  Sampling sampling{times, [&](std::size_t index, const StatePoint& at) {
                      const Index i = static_cast<Index>(index);
                      for (Index c = 0; c < n; ++c) {
                        y_bar.setZero(), rho_bar.setZero();
                        motion.s(c, i) = sensors[static_cast<std::size_t>(c)]->add_gradient(at, 1, y_bar, rho_bar);
                        motion.s_t(c, i) = y_bar.head(half).dot(at.y.tail(half));
                        if (i == 0) motion.weights(c) = weights[static_cast<std::size_t>(c)]->value(at);
                      }
                    }};
  const SimulationResult run = simulate(mechanism, settings_, {}, sampling, {nullptr, progress});
  if (!run.ok()) throw NoMotion(run.message);
  return motion;
}

// The lowest minimum of D on the polynomials, and at the ends of the run.
FreeInstants::Bracket FreeInstants::best(const Point& point, const Motion& scan) const {
  // D/2 and its rate
  const auto half_square = [&](const auto& of_channel) {
    Moving sum{0, 0};
    for (const Coordinate& c : point.coordinates) {
      const Moving s = of_channel(c.channel);
      const double w = scan.weights(static_cast<Index>(c.channel));
      sum.value += 0.5 * w * (s.value - c.target) * (s.value - c.target), sum.rate += w * (s.value - c.target) * s.rate;
    }
    return sum;
  };
  const auto at_row = [&](std::size_t i) {
    return half_square([&](std::size_t channel) { return scan.of(channel, i); });
  };
  const std::size_t last = scan.times.size() - 1;
  Bracket best{scan.times[0], scan.times[0], scan.times[0], std::numeric_limits<double>::infinity(), 1};
  const auto propose = [&](const Bracket& other) {
    if (other.square < best.square) best = other;
  };
  Moving left = at_row(0);
  if (left.rate >= 0) best.square = left.value;
  for (std::size_t i = 0; i < last; ++i) {
    const Moving right = at_row(i + 1);
    const double t = scan.times[i], h = scan.times[i + 1] - t;
    if (left.rate < 0 && right.rate >= 0) {
      const auto inside = [&](double u) {
        return half_square([&](std::size_t c) { return hermite(scan.of(c, i), scan.of(c, i + 1), h, u); });
      };
      double from = 0, to = 1;
      while (to - from > kSettled) {
        const double u = (from + to) / 2;
        (inside(u).rate < 0 ? from : to) = u;
      }
      const double u = (from + to) / 2, beside = std::sqrt(kSettled);
      const double curvature = (inside(u + beside).rate - inside(u - beside).rate) / (2 * beside * h);
      propose({t, t + h, t + u * h, inside(u).value, curvature});
    }
    left = right;
  }
  if (left.rate <= 0) propose({scan.times[last], scan.times[last], scan.times[last], left.value, 1});
  return best;
}

std::vector<double> FreeInstants::nearest(const Mechanism& mechanism,
                                          const std::function<bool(double t)>& progress) const {
  const Motion scan = motion_at(mechanism, scan_times(settings_), progress);
  std::vector<Bracket> brackets;
  std::vector<std::size_t> moving;  // points whose instant is not settled
  for (const Point& point : points_) {
    brackets.push_back(best(point, scan));
    if (!std::isfinite(brackets.back().square)) throw NoMotion("a tracked sensor has no value");
    if (brackets.back().from < brackets.back().to) moving.push_back(brackets.size() - 1);
  }
  for (int k = 0; k < kMostSteps && !moving.empty(); ++k) {
    std::ranges::sort(moving, {}, [&](std::size_t p) { return brackets[p].tau; });
    std::vector<double> times;
    for (const std::size_t p : moving) times.push_back(brackets[p].tau);
    const Motion motion = motion_at(mechanism, times, progress);
    std::vector<std::size_t> unsettled;
    for (std::size_t i = 0; i < moving.size(); ++i) {
      Bracket& b = brackets[moving[i]];
      double rate = 0;
      for (const Coordinate& c : points_[moving[i]].coordinates) {
        const Moving s = motion.of(c.channel, i);
        rate += motion.weights(static_cast<Index>(c.channel)) * (s.value - c.target) * s.rate;
      }
      if (k > 0 && b.tau != b.earlier) b.curvature = (rate - b.earlier_rate) / (b.tau - b.earlier);
      b.earlier = b.tau, b.earlier_rate = rate;
      (rate < 0 ? b.from : b.to) = b.tau;
      b.tau -= rate / b.curvature;
      if (!(b.tau > b.from && b.tau < b.to) && rate != 0) b.tau = (b.from + b.to) / 2;
      const double width = scan.times[1] - scan.times[0];
      if (k == 0 || std::abs(b.tau - b.earlier) > kSettled * width) unsettled.push_back(moving[i]);
    }
    moving = std::move(unsettled);
  }
  std::vector<double> tau;
  for (const Bracket& b : brackets) tau.push_back(b.tau);
  return tau;
}

}  // namespace mbsopt
