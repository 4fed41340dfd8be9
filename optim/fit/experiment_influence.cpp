#include "optim/fit/experiment_influence.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/fit/determined_combinations.hpp"
#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The same as for the rank of a fit, statistics.cpp: exact derivatives of a simulation carry errors of about 1e-12.
constexpr double kRankTolerance = 1e-8;

// [T | p], of which |T d + p| is to be small.
struct Rows {
  MatrixXd T;
  VectorXd p;
};

// The rows of both, reduced by Q' to as many as d has entries: of the rest |T d + p| does not depend on d.
Rows together(const Rows& a, const Rows& b) {
  const Index n = a.T.cols(), rows = a.T.rows() + b.T.rows();
  MatrixXd all(rows, n + 1);
  all.topLeftCorner(a.T.rows(), n) = a.T, all.topRightCorner(a.T.rows(), 1) = a.p;
  all.bottomLeftCorner(b.T.rows(), n) = b.T, all.bottomRightCorner(b.T.rows(), 1) = b.p;
  if (rows <= n) return {all.leftCols(n), all.rightCols(1)};
  const MatrixXd R = triangular_factor(std::move(all)).topRows(n);
  return {R.leftCols(n), R.rightCols(1)};
}

// argmin |T d + p| within the bounds; infinite where the rows do not determine an entry.
VectorXd least(const Rows& rows, const VectorXd& lower, const VectorXd& upper) {
  const Index n = rows.T.cols();
  VectorXd scale = rows.T.colwise().norm().transpose();  // columns of unit length
  for (double& s : scale) s = s > 0 ? 1 / s : 1;
  const OrthogonalDecomposition factors(rows.T * scale.asDiagonal(), kRankTolerance);
  VectorXd d = -scale.cwiseProduct(factors.solve(rows.p));
  if (factors.rank() < n) {
    const std::vector<bool> free = changed_parameters(factors.null_space());
    for (Index k = 0; k < n; ++k)
      if (free[static_cast<std::size_t>(k)]) d(k) = std::numeric_limits<double>::infinity();
    return d;
  }
  if ((d.array() >= lower.array()).all() && (d.array() <= upper.array()).all()) return d;
  return scale.cwiseProduct(bounded_linear_least_squares(MatrixXd(rows.T * scale.asDiagonal()), -rows.p,
                                                         lower.cwiseQuotient(scale), upper.cwiseQuotient(scale)));
}

// The rows of each member in the shared variables once its own variables are eliminated, and those of their priors.
struct SharedRows {
  std::vector<Index> shared;
  Rows priors;
  std::vector<Rows> parts;
};

SharedRows shared_rows(const ExperimentStack& stack, const LeastSquaresResult& solution,
                       const std::vector<UnknownParameter>& unknowns) {
  const VectorXd &x = solution.x, &z = solution.point.z;
  const MatrixXd& z_x = solution.point.z_x;
  std::vector<Index> shared, number(unknowns.size(), -1);
  for (std::size_t k = 0; k < unknowns.size(); ++k)
    if (unknowns[k].shared) number[k] = static_cast<Index>(shared.size()), shared.push_back(static_cast<Index>(k));
  const Index n = static_cast<Index>(shared.size());
  const VectorXd w = stack.weights(z).cwiseSqrt();
  const auto is_at_bound = [&](Index k) { return x(k) <= stack.x_lower(k) || x(k) >= stack.x_upper(k); };

  Rows priors{MatrixXd(0, n), VectorXd(0)};  // of shared variables
  std::vector<Rows> parts;
  for (const Dependence& part : stack.parts) {  // those of the members first
    std::vector<Index> order, here;             // here: numbers of its shared variables
    for (const Index k : part.variables)
      if (number[static_cast<std::size_t>(k)] < 0 && !is_at_bound(k)) order.push_back(k);
    const Index own = static_cast<Index>(order.size());
    for (const Index k : part.variables)
      if (number[static_cast<std::size_t>(k)] >= 0)
        order.push_back(k), here.push_back(number[static_cast<std::size_t>(k)]);
    std::vector<Index> rows_here;
    for (const Index row : part.rows) {
      if (row >= stack.samples() && !z_x(row, shared).isZero(0))
        priors = together(priors, {z_x(row, shared), z.segment(row, 1)});
      else
        rows_here.push_back(row);
    }
    if (rows_here.empty()) continue;  // a part of priors, which come last
    const Index columns = static_cast<Index>(order.size()), rows = static_cast<Index>(rows_here.size());
    MatrixXd J(rows, columns + 1);
    J.leftCols(columns) = w(rows_here).asDiagonal() * z_x(rows_here, order);
    J.rightCols(1) = w(rows_here).cwiseProduct(z(rows_here));
    const MatrixXd R = triangular_factor(std::move(J)).topRows(std::min(rows, columns));
    const Index left = std::max<Index>(R.rows() - own, 0);
    Rows& rest = parts.emplace_back(Rows{MatrixXd::Zero(left, n), R.bottomRows(left).rightCols(1)});
    rest.T(Eigen::all, here) = R.bottomRows(left).middleCols(own, columns - own);
  }
  return {std::move(shared), std::move(priors), std::move(parts)};
}

}  // namespace

std::vector<VectorXd> changes_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                      const std::vector<UnknownParameter>& unknowns) {
  const VectorXd& x = solution.x;
  const auto [shared, priors, parts] = shared_rows(stack, solution, unknowns);
  const Index n = static_cast<Index>(shared.size());
  // The rows of all parts from e on; those before e are gathered on the way.
  std::vector<Rows> from(parts.size() + 1, priors);
  for (std::size_t e = parts.size(); e-- > 0;) from[e] = together(from[e + 1], parts[e]);
  Rows before{MatrixXd(0, n), VectorXd(0)};
  const VectorXd lower = (stack.x_lower - x)(shared), upper = (stack.x_upper - x)(shared);
  std::vector<VectorXd> changes;
  for (std::size_t e = 0; e < stack.members().size(); ++e) {
    VectorXd& change = changes.emplace_back(VectorXd::Zero(x.size()));
    if (n > 0) change(shared) = least(together(before, from[e + 1]), lower, upper);
    before = together(before, parts[e]);
  }
  return changes;
}

std::vector<OthersWithout> others_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                          const std::vector<UnknownParameter>& unknowns,
                                          const std::vector<std::size_t>& record_of_member) {
  const SharedRows rows = shared_rows(stack, solution, unknowns);
  const VectorXd pull = stack.weights(solution.point.z).cwiseSqrt().cwiseProduct(solution.point.z);
  std::vector<OthersWithout> all(*std::ranges::max_element(record_of_member) + 1);
  for (std::size_t record = 0; record < all.size(); ++record) {
    Rows others = rows.priors;
    Index first = 0;
    for (std::size_t m = 0; m < record_of_member.size(); ++m) {
      const Index n = static_cast<Index>(stack.members()[m].model.samples().size());
      if (record_of_member[m] != record) {
        others = together(others, rows.parts[m]);
        all[record].samples += n, all[record].before += pull.segment(first, n).squaredNorm();
      }
      first += n;
    }
    const VectorXd left = others.p - others.T * OrthogonalDecomposition(others.T, kRankTolerance).solve(others.p);
    all[record].after = std::max(all[record].before - others.p.squaredNorm() + left.squaredNorm(), 0.0);
  }
  return all;
}

}  // namespace mbsopt
