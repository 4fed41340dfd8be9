#include "optim/objective/free_instants.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>

#include "core/simulate/simulation.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr long kRows = 200;       // of output, when output_step is absent
constexpr long kMostRows = 2000;  // a curve with more minima than that is no path of a mechanism
// The last step of the secant method in parts of a bracket. It leaves less than a hundred-thousandth of itself.
constexpr double kSettled = 1e-7;
constexpr int kMostSteps = 30;    // halving alone makes a bracket a billionth of itself
constexpr double kClosed = 1e-9;  // of its extent, between both ends of a closed path

std::vector<double> scan_times(const SimulationSettings& s) {
  const double span = s.end_time - s.start_time;
  const double rows = s.output_step ? std::ceil(span / *s.output_step) : static_cast<double>(kRows);
  const long n = static_cast<long>(std::clamp(rows, 4.0, static_cast<double>(kMostRows)));
  std::vector<double> times;
  for (long i = 0; i < n; ++i) times.push_back(s.start_time + span * static_cast<double>(i) / static_cast<double>(n));
  times.push_back(s.end_time);
  return times;
}

// A number and its time derivative.
struct Moving {
  double value, rate;
};

// The cubic through values and rates at both ends of an interval of length h, evaluated at its part u.
Moving hermite(const Moving& a, const Moving& b, double h, double u) {
  const double d = b.value - a.value, p = h * a.rate, q = h * b.rate;
  const double c2 = 3 * d - 2 * p - q, c3 = p + q - 2 * d;
  return {a.value + u * (p + u * (c2 + u * c3)), (p + u * (2 * c2 + 3 * u * c3)) / h};
}

// A column of D for each point, from `first` on round the circle. Columns do not fall, and their sum is least.
struct Columns {
  double sum = std::numeric_limits<double>::infinity();
  std::vector<std::size_t> of_points;
};
Columns columns_in_order(const MatrixXd& D, Index first) {
  MatrixXd least(D.rows(), D.cols());  // (k, i): the least sum of points 0 to k, with point k at column i or before it
  Eigen::MatrixXi at(D.rows(), D.cols());
  for (Index k = 0; k < D.rows(); ++k) {
    for (Index i = 0; i < D.cols(); ++i) {
      least(k, i) = D((first + k) % D.rows(), i) + (k > 0 ? least(k - 1, i) : 0);
      at(k, i) = static_cast<int>(i);
      if (i > 0 && least(k, i - 1) <= least(k, i)) {
        least(k, i) = least(k, i - 1);
        at(k, i) = at(k, i - 1);
      }
    }
  }
  Columns found{least(D.rows() - 1, D.cols() - 1), std::vector<std::size_t>(static_cast<std::size_t>(D.rows()))};
  Index column = D.cols() - 1;
  for (Index k = D.rows() - 1; k >= 0; --k) {
    column = at(k, column);
    found.of_points[static_cast<std::size_t>(k)] = static_cast<std::size_t>(column);
  }
  return found;
}

}  // namespace

// The channels at given times, one column per time.
struct FreeInstants::Motion {
  std::vector<double> times;
  MatrixXd s, s_t;
  VectorXd weights;
  Moving at(std::size_t channel, std::size_t time) const {
    const Index c = static_cast<Index>(channel), i = static_cast<Index>(time);
    return {s(c, i), s_t(c, i)};
  }
};

// Points that share the instant tau, where the sum of their D/2 has a minimum. Its rate is negative at `from` and
// positive at `to`, or both are one end of the run.
struct FreeInstants::Block {
  std::vector<std::size_t> points;
  double from = 0, to = 0, tau = 0;
  double square = std::numeric_limits<double>::infinity();  // D/2 at tau
  double curvature = 1;                                     // of D/2
  double earlier = 0, earlier_rate = 0;                     // tau before this one, and the rate of D/2 there
  std::size_t node = 0;                                     // its node in the scan
};

// Finds minima on the polynomials between the instants of a scan, its nodes.
struct FreeInstants::Scan {
  const FreeInstants& free;
  const Motion motion;
  using Points = std::vector<std::size_t>;

  std::size_t last() const { return motion.times.size() - 1; }
  double step() const { return motion.times[1] - motion.times[0]; }

  // D/2 and its rate, from channels(c) or at a node.
  Moving half_square(const Points& points, const VectorXd& weights, const auto& channels) const {
    Moving sum{0, 0};
    for (const std::size_t p : points) {
      for (const Coordinate& c : free.points_[p].coordinates) {
        const Moving s = channels(c.channel);
        const double w = weights(static_cast<Index>(c.channel)), off = s.value - c.target;
        sum.value += 0.5 * w * off * off;
        sum.rate += w * off * s.rate;
      }
    }
    return sum;
  }
  Moving at(const Points& points, const Motion& m, std::size_t i) const {
    return half_square(points, m.weights, [&](std::size_t c) { return m.at(c, i); });
  }

  Block at_end(const Points& points, std::size_t i) const {
    const double t = motion.times[i];
    return {points, t, t, t, at(points, motion, i).value};
  }
  // The minimum between the nodes i and i + 1.
  Block between(const Points& points, std::size_t i) const {
    const double t = motion.times[i], h = motion.times[i + 1] - t;
    const auto inside = [&](double u) {
      return half_square(points, motion.weights,
                         [&](std::size_t c) { return hermite(motion.at(c, i), motion.at(c, i + 1), h, u); });
    };
    double from = 0, to = 1;
    while (to - from > kSettled) {
      const double u = (from + to) / 2;
      (inside(u).rate < 0 ? from : to) = u;
    }
    const double u = (from + to) / 2, beside = std::sqrt(kSettled);
    return {points,          t,
            t + h,           t + u * h,
            inside(u).value, (inside(u + beside).rate - inside(u - beside).rate) / (2 * beside * h)};
  }

  // The lowest minimum.
  Block best(const Points& points) const {
    Block best;
    const auto propose = [&](const Block& other) {
      if (other.square < best.square) best = other;
    };
    Moving left = at(points, motion, 0);
    if (left.rate >= 0) propose(at_end(points, 0));
    for (std::size_t i = 0; i < last(); ++i) {
      const Moving right = at(points, motion, i + 1);
      if (left.rate < 0 && right.rate >= 0) propose(between(points, i));
      left = right;
    }
    if (left.rate <= 0) propose(at_end(points, last()));
    return best;
  }

  // The minimum downhill from a node.
  Block downhill(const Points& points, std::size_t node) const {
    const auto falls = [&](std::size_t i) { return at(points, motion, i).rate < 0; };
    std::size_t i = node;
    while (i < last() && falls(i)) ++i;
    if (i == node && !falls(i))
      while (i > 0 && !falls(i - 1)) --i;
    // D falls before i and not at i, or i is an end.
    const bool is_end = i == 0 || (i == last() && falls(i));
    Block block = is_end ? at_end(points, i) : between(points, i - 1);
    block.node = node;
    return block;
  }

  bool is_closed() const {
    const VectorXd extent = motion.s.rowwise().maxCoeff() - motion.s.rowwise().minCoeff();
    return (motion.s.col(static_cast<Index>(last())) - motion.s.col(0)).norm() <= kClosed * extent.norm();
  }

  // Finds the best nodes in the order of a file's rows, then goes downhill from these to minima. Neighbours whose
  // minima have the opposite order share one instant.
  std::vector<Block> in_order(const Points& rows) const {
    MatrixXd D(static_cast<Index>(rows.size()), motion.s.cols());
    for (std::size_t k = 0; k < rows.size(); ++k)
      for (std::size_t i = 0; i <= last(); ++i)
        D(static_cast<Index>(k), static_cast<Index>(i)) = at({rows[k]}, motion, i).value;
    Columns nodes;
    std::size_t first = 0;
    for (std::size_t start = 0; start < (is_closed() ? rows.size() : 1); ++start) {
      Columns other = columns_in_order(D, static_cast<Index>(start));
      if (other.sum < nodes.sum) {
        nodes = std::move(other);
        first = start;
      }
    }
    std::vector<Block> blocks;
    for (std::size_t k = 0; k < nodes.of_points.size(); ++k) {
      blocks.push_back(downhill({rows[(first + k) % rows.size()]}, nodes.of_points[k]));
      while (blocks.size() > 1 && blocks.back().tau < blocks[blocks.size() - 2].tau) {
        const Block after = std::move(blocks.back());
        blocks.pop_back();
        Points both = blocks.back().points;
        both.insert(both.end(), after.points.begin(), after.points.end());
        blocks.back() = downhill(both, blocks.back().node);
      }
    }
    return blocks;
  }

  std::vector<Block> all() const {
    std::vector<Block> blocks;
    std::map<std::string, std::map<std::size_t, std::size_t>> ordered;  // points by file and row
    for (std::size_t p = 0; p < free.points_.size(); ++p) {
      const Point& point = free.points_[p];
      if (point.ordered)
        ordered[point.file][point.row] = p;
      else
        blocks.push_back(best({p}));
    }
    for (const auto& [file, rows] : ordered) {
      Points in_rows;
      for (const auto& [row, p] : rows) in_rows.push_back(p);
      std::ranges::move(in_order(in_rows), std::back_inserter(blocks));
    }
    return blocks;
  }
};

FreeInstants::FreeInstants(const SimulationSettings& settings) {
  settings_.start_time = settings.start_time;
  settings_.end_time = settings.end_time;
  settings_.output_step = settings.output_step;
  settings_.solve = Solve::kinematics;
}

std::vector<std::size_t> FreeInstants::add(const std::string& file, bool ordered, const Curve& targets,
                                           const CostExpression& sensor, const CostExpression& weight) {
  std::vector<std::size_t> numbers;
  for (std::size_t k = 0; k < targets.x().size(); ++k) {
    const std::size_t row = static_cast<std::size_t>(targets.x()[k]);
    auto point = std::ranges::find_if(
        points_, [&](const Point& p) { return p.row == row && p.file == file && p.ordered == ordered; });
    if (point == points_.end()) point = points_.insert(points_.end(), {file, ordered, row, {}});
    point->coordinates.push_back({channels_.size(), targets.y()[k]});
    numbers.push_back(static_cast<std::size_t>(point - points_.begin()));
  }
  channels_.push_back({sensor, weight});
  return numbers;
}

FreeInstants::Motion FreeInstants::motion_at(const Mechanism& mechanism, const std::vector<double>& times,
                                             const std::function<bool(double t)>& progress) const {
  const Index n = static_cast<Index>(channels_.size()), half = mechanism.states() / 2;
  Motion motion{times, MatrixXd(n, times.size()), MatrixXd(n, times.size()), VectorXd(n)};
  std::vector<std::shared_ptr<const PointCost>> sensors, weights;
  for (const Channel& channel : channels_) {
    sensors.push_back(channel.sensor.bind(mechanism));
    weights.push_back(channel.weight.bind(mechanism));
  }
  VectorXd y_bar(mechanism.states()), rho_bar(mechanism.rho().size());
  Sampling sampling{times, [&](std::size_t index, const StatePoint& at) {
                      const Index i = static_cast<Index>(index);
                      for (Index c = 0; c < n; ++c) {
                        y_bar.setZero();
                        rho_bar.setZero();
                        motion.s(c, i) = sensors[static_cast<std::size_t>(c)]->add_gradient(at, 1, y_bar, rho_bar);
                        motion.s_t(c, i) = y_bar.head(half).dot(at.y.tail(half));
                        if (i == 0) motion.weights(c) = weights[static_cast<std::size_t>(c)]->value(at);
                      }
                    }};
  const SimulationResult run = simulate(mechanism, settings_, {}, sampling, {nullptr, progress});
  if (!run.ok()) throw NoMotion(run.message);
  return motion;
}

std::vector<FreeInstants::Instant> FreeInstants::nearest(const Mechanism& mechanism,
                                                         const std::function<bool(double t)>& progress) const {
  const Scan scan{*this, motion_at(mechanism, scan_times(settings_), progress)};
  std::vector<Block> blocks = scan.all();
  std::vector<Block*> moving;  // whose instant is not settled
  for (Block& block : blocks) {
    if (!std::isfinite(block.square)) throw NoMotion("a tracked sensor has no value");
    if (block.from < block.to) moving.push_back(&block);
  }
  for (int k = 0; k < kMostSteps && !moving.empty(); ++k) {
    std::ranges::sort(moving, {}, &Block::tau);
    std::vector<double> times;
    for (const Block* const b : moving) times.push_back(b->tau);
    const Motion motion = motion_at(mechanism, times, progress);
    std::vector<Block*> unsettled;
    for (std::size_t i = 0; i < moving.size(); ++i) {
      Block& b = *moving[i];
      const double rate = scan.at(b.points, motion, i).rate;
      if (k > 0 && b.tau != b.earlier) b.curvature = (rate - b.earlier_rate) / (b.tau - b.earlier);
      b.earlier = b.tau;
      b.earlier_rate = rate;
      (rate < 0 ? b.from : b.to) = b.tau;
      b.tau -= rate / b.curvature;
      const double settled = kSettled * scan.step();  // a minimum at a node may lie so far beyond the bracket
      if (!(b.tau > b.from - settled && b.tau < b.to + settled)) b.tau = (b.from + b.to) / 2;
      b.tau = std::clamp(b.tau, settings_.start_time, settings_.end_time);
      if (k == 0 || std::abs(b.tau - b.earlier) > settled) unsettled.push_back(&b);
    }
    moving = std::move(unsettled);
  }
  std::vector<Instant> instants(points_.size());
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (const std::size_t p : blocks[b].points) instants[p] = {blocks[b].tau, b};
  return instants;
}

}  // namespace mbsopt::inline optim
