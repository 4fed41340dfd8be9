#include "core/watch/quadrature_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/body/hermite.hpp"
#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {
namespace {

constexpr double kPoor = 1e-4;        // of the integral of |g| so far: a larger estimate starts a search in the step
constexpr double kNarrowest = 1e-12;  // of a step
constexpr double kFalls = 0.03;       // |g| times width does by more over half of all halvings, up to |t|^-0.7
constexpr double kBounded = 1e-7;     // of a step: a |g| that has not grown threefold there is bounded
constexpr int kPoints = 9, kMostSearches = 200;
constexpr double kOffset = 0.471;      // not half: poles are at round times
constexpr double kMetExactly = 1e-12;  // estimates below it are rounding
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

}  // namespace

std::vector<QuadratureNode> quadrature_nodes(int n, const double* c, const double* b, std::vector<int>& node_of) {
  std::vector<QuadratureNode> nodes;
  for (int i = 0; i < n; ++i) {
    node_of.push_back(-1);
    if (b[i] == 0) continue;
    const auto same = [&](const QuadratureNode& node) { return std::abs(node.c - c[i]) < 1e-12; };
    const auto node = std::find_if(nodes.begin(), nodes.end(), same);
    node_of.back() = static_cast<int>(node - nodes.begin());
    if (node == nodes.end()) nodes.push_back({c[i], 0, 0});
    nodes[static_cast<std::size_t>(node_of.back())].b += b[i];
  }
  double least = std::numeric_limits<double>::infinity();
  for (QuadratureNode& node : nodes) {
    node.e = 1;
    for (const QuadratureNode& other : nodes) {
      if (other.c != node.c) node.e /= node.c - other.c;
    }
    least = std::min(least, std::abs(node.e / node.b));
  }
  for (QuadratureNode& node : nodes) node.e /= least;
  return nodes;
}

QuadratureWatch::QuadratureWatch(const Mechanism& mechanism, const Method& method, std::span<const Cost> costs, Of what,
                                 MotionSource* motion)
    : mechanism_(mechanism),
      method_(method),
      costs_(costs),
      of_values_(what == Of::values),
      motion_(motion),
      nodes_(quadrature_nodes(method.nodes, method.node_c, method.node_b, node_of_)),
      weights_(std::accumulate(nodes_.begin(), nodes_.end(), 0.0,
                               [](double sum, const QuadratureNode& node) { return sum + std::abs(node.b); })),
      integrals_((of_values_ ? 1 : 2) * costs.size()),
      g_(integrals_.size() * static_cast<std::size_t>(method.nodes), 0.0),
      distinct_(nodes_.size()) {
  if (of_values_) return;
  influence_.setZero(mechanism.states(), static_cast<Eigen::Index>(costs.size()));
  fastest_.setZero(mechanism.states());
}

void QuadratureWatch::take_gradient(std::size_t cost, int node, double weight, VecIn y_bar, VecIn ydot, VecIn rho_bar) {
  const Eigen::VectorXd& rho = mechanism_.rho();
  double along_parameters = 0;
  for (const int p : mechanism_.data().active)  // a parameter of value 0 counts with the size 1
    along_parameters += rho_bar(p) * (rho(p) == 0 ? 1 : rho(p));
  influence_.col(static_cast<Eigen::Index>(cost)) += y_bar.cwiseAbs();
  fastest_ = fastest_.cwiseMax(ydot.cwiseAbs());
  at_node(0, cost, node) = y_bar.dot(ydot) / weight;
  at_node(1, cost, node) = along_parameters / weight;
}

std::string QuadratureWatch::end_step(const Step& step) {
  if (start_ == end_) start_ = end_ = step.t;
  start_ = std::min(start_, step.t);
  end_ = std::max(end_, step.t + step.h);
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    if (!costs_[o].running) continue;
    const double error = add_error(step, 0, o);
    if (!of_values_) {
      add_error(step, 1, o);
      continue;
    }
    Integral& integral = integrals_[o];
    if (costs_[o].is_extreme || !(error > kPoor * weights_ * integral.of_size) || integral.searches++ > kMostSearches)
      continue;
    const double t = pole(step, *costs_[o].running);
    if (std::isnan(t)) continue;
    return fmt::format(
        "the running cost{} grows about like 1/|t - {:.6g} s| or faster near t = {:.6g} s, so that its integral does "
        "not exist: keep its denominators away from zero, or end the run before",
        costs_[o].name.empty() ? "" : " of objective '" + costs_[o].name + "'", t, t);
  }
  return {};
}

double QuadratureWatch::add_error(const Step& step, std::size_t integrand, std::size_t cost) {
  Integral& integral = integrals_[place(integrand, cost)];
  std::fill(distinct_.begin(), distinct_.end(), 0.0);
  for (int i = 0; i < method_.nodes; ++i) {
    if (node_of_[static_cast<std::size_t>(i)] < 0) continue;
    const std::size_t node = static_cast<std::size_t>(node_of_[static_cast<std::size_t>(i)]);
    distinct_[node] += method_.node_b[i] / nodes_[node].b * at_node(integrand, cost, i);
  }
  double size = 0, difference = 0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    size += step.h * std::abs(nodes_[k].b * distinct_[k]);
    difference += step.h * nodes_[k].e * distinct_[k];
  }
  int power = static_cast<int>(nodes_.size()) - 1;
  if (power == 0) {
    difference = integral.of_size > 0 ? step.h * 0.5 * (distinct_[0] - integral.last_g) : 0;
    integral.last_g = distinct_[0];
    power = 1;
  }
  if (!(size > 0 && std::isfinite(size))) return 0;  // the end of the run reports it
  integral.of_size += size / weights_;
  const double share = std::min(1.0, std::abs(difference) / size);
  const double error = size * std::pow(share, static_cast<double>(method_.order) / power);
  integral.error += error;
  if (error > integral.worst) {
    integral.worst = error;
    integral.worst_t = step.t;
  }
  return error;
}

// The time of a pole within the step, or kNone.
double QuadratureWatch::pole(const Step& step, const PointCost& cost) {
  const double h = step.h;
  const auto size = [&](double s) {
    hermite(step.y0, step.y1, h, s, y_);
    return std::abs(cost.value({step.t + s * h, y_, step.angles0, motion_}));
  };
  double at = 0, largest = -1;
  const auto take = [&](double s) {
    const double here = s >= 0 && s <= 1 ? size(s) : -1;
    if (here > largest) {
      at = s;
      largest = here;
    }
  };
  take(0);
  take(1);
  for (int i = 0; i < kPoints; ++i) take((i + kOffset) / kPoints);
  if (largest == 0) return kNone;
  const double first = largest;
  const double narrowest = std::max(kNarrowest, 1e-15 * std::abs(step.t) / h);
  const double halfway = std::sqrt(narrowest);
  double product = std::numeric_limits<double>::infinity();
  for (double width = 1.0 / kPoints; width > narrowest; width /= 2) {
    const double s = at;
    take(s - 0.5 * width);
    take(s + 0.5 * width);
    if (!std::isfinite(largest)) return step.t + at * h;
    if (width < kBounded && largest < 3 * first) return kNone;  // the usual case
    if (width > halfway) product = std::min(product, width * largest);
    if (width * largest < kFalls * product) return kNone;
  }
  return step.t + at * h;
}

void QuadratureWatch::add_to(SimulationStatistics& statistics) const {
  // Errors up to `rounding` have no meaning.
  const auto judge = [](const Integral& i, double of_size, double rounding, const Cost& cost, QuadratureError& worst) {
    if (i.error > worst.error * of_size && i.error > rounding) worst = {i.error / of_size, cost.name, i.worst_t};
  };
  for (std::size_t o = 0; o < costs_.size(); ++o) {
    const Cost& cost = costs_[o];
    if (of_values_) {
      const Integral& value = integrals_[o];
      // Exponentials have any size, so their rounding is relative.
      const double rounding = cost.is_extreme ? kMetExactly * value.of_size : kMetExactly;
      judge(value, value.of_size, rounding, cost,
            cost.is_extreme ? statistics.extreme_quadrature : statistics.quadrature);
      continue;
    }
    // Both parts count relative to their sum: a part that is negligible beside the other does not matter.
    Integral motion = integrals_[place(0, o)];
    const Integral& parameters = integrals_[place(1, o)];
    const double influence = influence_.col(static_cast<Eigen::Index>(o)).dot(fastest_);
    motion.error *= end_ - start_;
    motion.of_size = std::max(motion.of_size, influence) * (end_ - start_);
    for (const Integral* part : {static_cast<const Integral*>(&motion), &parameters})
      judge(*part, motion.of_size + parameters.of_size, cost.is_extreme ? 0 : kMetExactly, cost,
            statistics.gradient_quadrature);
  }
}

}  // namespace mbsopt
