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

// The dual problem of a step, over the rows that have joined.
class Dual {
 public:
  Dual(const SqpModel& model, const MatrixXd& L, double nu, SqpModel::Violations violations)
      : model_(model),
        L_(L),
        nu_(nu),
        n_(model.g.size()),
        m_(static_cast<Index>(model.rows.size())),
        r_(L.triangularView<Eigen::Lower>().solve(model.g)),
        is_taken_(static_cast<std::size_t>(m_ + 2 * n_), false) {
    std::map<Index, int> rows;
    for (const SqpRow& row : model.rows) {
      if (row.row < 0) extremes_.emplace(row.row, static_cast<Index>(extremes_.size()));
      if (violations == SqpModel::Violations::of_constraints && row.row >= 0 && ++rows[row.row] == 2)
        shared_.emplace(row.row, static_cast<Index>(shared_.size()));
    }
  }

  SqpStep solve() {
    for (Index j = 0; j < m_; ++j)
      if (const SqpRow& row = row_at(j); row.row < 0 || row.u <= 0 || row.is_equality) take(j);
    const Index most_turns = m_ + 2 * n_ + 1;
    SqpStep step;
    for (Index turn = 0; turn < most_turns; ++turn) {
      solve_taken();
      step.d = primal();
      if (turn < most_turns / 2) leave();
      if (!take_broken(step.d)) break;
    }
    step.y.setZero(m_);
    for (std::size_t c = 0; c < taken_.size(); ++c)
      if (taken_[c] < m_) step.y(taken_[c]) = y_[c];
    step.d = step.d.cwiseMax(model_.lower).cwiseMin(model_.upper);
    step.ok = step.d.allFinite();
    return step;
  }

 private:
  // Column j is row j of the model; beyond them the lower bounds of the variables, then the upper ones.
  struct Column {
    VectorXd a;
    double u, least, most;
  };
  Column column(Index j) const {
    if (j < m_) {
      const SqpRow& row = row_at(j);
      return {row.a, row.u, row.is_equality ? -nu_ : 0, row.row < 0 ? kInfinity : nu_};
    }
    const Index k = (j - m_) % n_;
    const bool is_upper = j - m_ >= n_;
    return {(is_upper ? 1 : -1) * VectorXd::Unit(n_, k), is_upper ? model_.upper(k) : -model_.lower(k), 0, kInfinity};
  }

  void solve_taken() {
    constexpr double kGivesWay = 1e-10;            // delta: scaled multipliers are about 1, limits hold to 1e-8
    constexpr double kCurvatureOfExtremes = 1e-3;  // tau: the multipliers of pieces sum up to 1 - tau t
    const double root = std::sqrt(kGivesWay / std::max(1.0, nu_)), weight = 1 / std::sqrt(kCurvatureOfExtremes);
    const Index columns = static_cast<Index>(taken_.size()), extremes = static_cast<Index>(extremes_.size()),
                shared = static_cast<Index>(shared_.size()), sums = n_ + extremes, own = sums + shared;
    y_.assign(taken_.size(), 0);
    LA_.resize(n_, columns);
    if (columns == 0) return;
    MatrixXd M = MatrixXd::Zero(own + columns, columns + shared);
    VectorXd b = VectorXd::Zero(M.rows()), least = VectorXd::Zero(M.cols()),
             most = VectorXd::Constant(M.cols(), kInfinity);
    b.head(n_) = -r_;
    b.segment(n_, extremes).setConstant(weight);
    b.segment(sums, shared).setConstant(weight * nu_);
    M.block(sums, columns, shared, shared).diagonal().setConstant(weight);  // what the multipliers leave of nu
    for (Index c = 0; c < columns; ++c) {
      const Index j = taken_[static_cast<std::size_t>(c)];
      const Column of = column(j);
      least(c) = of.least;
      most(c) = of.most;
      LA_.col(c) = L_.triangularView<Eigen::Lower>().solve(of.a);
      M.col(c).head(n_) = LA_.col(c);
      if (j < m_ && row_at(j).row < 0) M(n_ + extremes_.at(row_at(j).row), c) = weight;
      if (j < m_ && shared_.contains(row_at(j).row)) M(sums + shared_.at(row_at(j).row), c) = weight;
      M(own + c, c) = root;
      b(own + c) = -of.u / root;
    }
    const VectorXd y = bounded_linear_least_squares(M, b, least, most).head(columns);
    y_.assign(y.begin(), y.end());
  }

  // d = -H^-1 (g + A'y)
  VectorXd primal() const {
    VectorXd sum = r_;
    for (std::size_t c = 0; c < y_.size(); ++c) sum += y_[c] * LA_.col(static_cast<Index>(c));
    return -L_.triangularView<Eigen::Lower>().transpose().solve(sum);
  }

  bool take(Index j) {
    if (is_taken_[static_cast<std::size_t>(j)]) return false;
    is_taken_[static_cast<std::size_t>(j)] = true;
    taken_.push_back(j);
    return true;
  }

  // Rows that nothing pushes leave again: their distances would only add to the rounding.
  void leave() {
    for (std::size_t c = taken_.size(); c-- > 0;) {
      if (y_[c] != 0 || (taken_[c] < m_ && row_at(taken_[c]).row < 0)) continue;
      is_taken_[static_cast<std::size_t>(taken_[c])] = false;
      taken_.erase(taken_.begin() + static_cast<std::ptrdiff_t>(c));
      y_.erase(y_.begin() + static_cast<std::ptrdiff_t>(c));
    }
  }

  // Returns whether a row joined.
  bool take_broken(const VectorXd& d) {
    constexpr double kBroken = 1e-12;  // by more than rounding
    bool joined = false;
    for (Index j = 0; j < m_; ++j)
      if (row_at(j).row >= 0 && row_at(j).a.dot(d) - row_at(j).u > kBroken) joined = take(j) || joined;
    for (Index k = 0; k < n_; ++k) {
      if (d(k) < model_.lower(k)) joined = take(m_ + k) || joined;
      if (d(k) > model_.upper(k)) joined = take(m_ + n_ + k) || joined;
    }
    return joined;
  }

  const SqpRow& row_at(Index j) const { return model_.rows[static_cast<std::size_t>(j)]; }

  const SqpModel& model_;
  const MatrixXd& L_;  // H = L L'
  const double nu_;
  const Index n_, m_;
  const VectorXd r_;                 // L^-1 g
  std::map<Index, Index> extremes_;  // in f: their numbers by NlpPiece::row
  std::map<Index, Index> shared_;    // constraints of several rows: their numbers
  std::vector<bool> is_taken_;
  std::vector<Index> taken_;
  std::vector<double> y_;  // of the columns taken
  MatrixXd LA_;            // L^-1 a of each
};

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

SqpStep SqpModel::step(const MatrixXd& H, double nu, Violations violations) const {
  const MatrixXd L = cholesky_factor(H);
  if (L.size() == 0) return {};
  return Dual(*this, L, nu, violations).solve();
}

}  // namespace mbsopt::inline optim
