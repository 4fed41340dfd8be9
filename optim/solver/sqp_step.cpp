#include "optim/solver/sqp_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The violation of each constraint, its rows taken together: the worst one counts.
double sum_of_worst(const std::vector<SqpRow>& rows, const std::vector<double>& excess) {
  std::map<Index, double> worst;
  for (std::size_t j = 0; j < rows.size(); ++j)
    if (rows[j].row >= 0) {
      double& w = worst[rows[j].row];
      w = std::max(w, rows[j].is_equality ? std::abs(excess[j]) : excess[j]);
    }
  double sum = 0;
  for (const auto& [row, most] : worst) sum += most;
  return sum;
}

std::vector<Index> others_than(Index k, Index count) {
  std::vector<Index> others;
  for (Index i = 0; i < count; ++i)
    if (i != k) others.push_back(i);
  return others;
}

}  // namespace

double scaled_violation(const NonlinearProgram& problem, const NlpPoint& point) {
  double sum = 0;
  for (Index i = 0; i < problem.constraints(); ++i)
    sum += problem.c_scale(i) * std::max({0.0, point.c(i) - problem.c_upper(i), problem.c_lower(i) - point.c(i)});
  return sum;
}

SqpModel::SqpModel(const NonlinearProgram& problem, const VectorXd& x, const NlpPoint& point)
    : g(problem.f_scale * point.f_x), lower(problem.x_lower - x), upper(problem.x_upper - x) {
  std::vector<bool> above(static_cast<std::size_t>(problem.constraints()), false), below = above;
  std::map<Index, double> largest;  // of the extremes in f
  for (const NlpPiece& piece : point.pieces)
    if (piece.row < 0) {
      const auto [top, is_first] = largest.emplace(piece.row, piece.value);
      if (is_first) g -= problem.f_scale * piece.gradient;  // the first of each is the largest
    }
  extremes = static_cast<Index>(largest.size());
  for (std::size_t k = 0; k < point.pieces.size(); ++k) {
    const NlpPiece& piece = point.pieces[k];
    if (piece.row < 0) {
      rows.push_back({problem.f_scale * piece.gradient, problem.f_scale * (largest[piece.row] - piece.value), piece.row,
                      static_cast<int>(k)});
      continue;
    }
    const double bound = piece.side > 0 ? problem.c_upper(piece.row) : problem.c_lower(piece.row);
    (piece.side > 0 ? above : below)[static_cast<std::size_t>(piece.row)] = true;
    if (!std::isfinite(bound)) continue;
    const double scale = piece.side * problem.c_scale(piece.row);
    rows.push_back({scale * piece.gradient, scale * (bound - piece.value), piece.row, static_cast<int>(k),
                    static_cast<double>(piece.side)});
  }
  for (Index i = 0; i < problem.constraints(); ++i) {
    const double scale = problem.c_scale(i), lowest = problem.c_lower(i), highest = problem.c_upper(i);
    const VectorXd a = scale * point.c_x.row(i).transpose();
    const bool has_above = above[static_cast<std::size_t>(i)], has_below = below[static_cast<std::size_t>(i)];
    if (lowest == highest && !has_above && !has_below) {
      rows.push_back({a, scale * (highest - point.c(i)), i, -1, 1, true});
      continue;
    }
    if (std::isfinite(highest) && !has_above) rows.push_back({a, scale * (highest - point.c(i)), i});
    if (std::isfinite(lowest) && !has_below) rows.push_back({-a, scale * (point.c(i) - lowest), i, -1, -1});
  }
}

double SqpModel::objective(const VectorXd& d) const {
  std::map<Index, double> largest;
  for (const SqpRow& r : rows) {
    if (r.row >= 0) continue;
    const double value = r.a.dot(d) - r.u;
    const auto [top, is_first] = largest.emplace(r.row, value);
    if (!is_first) top->second = std::max(top->second, value);
  }
  double change = g.dot(d);
  for (const auto& [row, value] : largest) change += value;
  return change;
}

double SqpModel::violation(const VectorXd& d) const {
  std::vector<double> excess;
  for (const SqpRow& r : rows) excess.push_back(r.a.dot(d) - r.u);
  return sum_of_worst(rows, excess);
}

void SqpModel::correct(const NonlinearProgram& problem, const VectorXd& d, const NlpPoint& there) {
  std::map<std::pair<Index, double>, double> linear;  // of each constraint and side: what the rows foretold
  for (const SqpRow& r : rows) {
    if (r.row < 0) continue;
    const double excess = r.a.dot(d) - r.u;
    const auto [worst, is_first] = linear.emplace(std::pair(r.row, r.sign), excess);
    if (!is_first) worst->second = std::max(worst->second, excess);
  }
  for (SqpRow& r : rows) {
    if (r.row < 0) continue;
    const double bound = r.sign > 0 ? problem.c_upper(r.row) : problem.c_lower(r.row);
    const double excess = r.sign * problem.c_scale(r.row) * (there.c(r.row) - bound);
    r.u -= excess - linear[{r.row, r.sign}];
  }
}

SqpStep SqpModel::step(const MatrixXd& H, double nu) const {
  constexpr double kGivesWay = 1e-10;            // delta: scaled multipliers are about 1, limits hold to 1e-8
  constexpr double kCurvatureOfExtremes = 1e-3;  // tau: the multipliers of pieces sum up to 1 - tau t
  constexpr double kBroken = 1e-12;              // by more than rounding
  const Index n = g.size();
  SqpStep step;
  step.y.setZero(static_cast<Index>(rows.size()));
  const MatrixXd L = cholesky_factor(H);
  if (L.size() == 0) return step;
  const auto triangle = L.triangularView<Eigen::Lower>();
  const VectorXd r = triangle.solve(g);
  // Column j of the dual problem is row j; beyond them the lower bounds of the variables, then the upper ones.
  const Index m = static_cast<Index>(rows.size());
  std::vector<Index> taken;
  std::vector<bool> is_taken(static_cast<std::size_t>(m + 2 * n), false);
  const auto take = [&](Index j) {
    if (is_taken[static_cast<std::size_t>(j)]) return false;
    is_taken[static_cast<std::size_t>(j)] = true;
    taken.push_back(j);
    return true;
  };
  const double root = std::sqrt(kGivesWay / std::max(1.0, nu)), weight = 1 / std::sqrt(kCurvatureOfExtremes);
  for (Index j = 0; j < m; ++j)
    if (const SqpRow& row = rows[static_cast<std::size_t>(j)]; row.row < 0 || row.u <= 0 || row.is_equality) take(j);
  VectorXd y;
  step.d = -triangle.transpose().solve(r);
  const Index most_turns = m + 2 * n + 1;
  for (Index turn = 0; turn < most_turns; ++turn) {
    if (!taken.empty()) {
      const Index columns = static_cast<Index>(taken.size());
      MatrixXd M = MatrixXd::Zero(n + extremes + columns, columns);
      VectorXd b = VectorXd::Zero(M.rows()), least = VectorXd::Zero(columns), most = VectorXd::Constant(columns, nu);
      b.head(n) = -r;
      b.segment(n, extremes).setConstant(weight);
      for (Index c = 0; c < columns; ++c) {
        const Index j = taken[static_cast<std::size_t>(c)];
        VectorXd a = VectorXd::Zero(n);
        double u = 0;
        if (j < m) {
          const SqpRow& row = rows[static_cast<std::size_t>(j)];
          a = row.a;
          u = row.u;
          if (row.row < 0) {
            M(n - 1 - row.row, c) = weight;
            most(c) = kInfinity;
          }
          if (row.is_equality) least(c) = -nu;
        } else {
          const Index k = (j - m) % n;
          const bool is_upper = j - m >= n;
          a(k) = is_upper ? 1 : -1;
          u = is_upper ? upper(k) : -lower(k);
          most(c) = kInfinity;
        }
        M.col(c).head(n) = triangle.solve(a);
        M(n + extremes + c, c) = root;
        b(n + extremes + c) = -u / root;
      }
      y = bounded_linear_least_squares(M, b, least, most);
      step.d = -triangle.transpose().solve(VectorXd(r + M.topRows(n) * y));
    }
    // Rows that nothing pushes leave again: their distances would only add to the rounding.
    bool joined = false;
    for (std::size_t c = taken.size(); c-- > 0 && turn < most_turns / 2;) {
      if (y(static_cast<Index>(c)) != 0 || (taken[c] < m && rows[static_cast<std::size_t>(taken[c])].row < 0)) continue;
      is_taken[static_cast<std::size_t>(taken[c])] = false;
      taken.erase(taken.begin() + static_cast<std::ptrdiff_t>(c));
      y = VectorXd(y)(others_than(static_cast<Index>(c), y.size()));
    }
    for (Index j = 0; j < m; ++j) {
      const SqpRow& row = rows[static_cast<std::size_t>(j)];
      if (row.row < 0) continue;  // all are taken
      if (row.a.dot(step.d) - row.u > kBroken) joined = take(j) || joined;
    }
    for (Index k = 0; k < n; ++k) {
      if (step.d(k) < lower(k)) joined = take(m + k) || joined;
      if (step.d(k) > upper(k)) joined = take(m + n + k) || joined;
    }
    if (!joined) break;
  }
  for (std::size_t c = 0; c < taken.size(); ++c)
    if (taken[c] < m) step.y(taken[c]) = y(static_cast<Index>(c));
  step.d = step.d.cwiseMax(lower).cwiseMin(upper);
  step.ok = step.d.allFinite();
  return step;
}

}  // namespace mbsopt::inline optim
