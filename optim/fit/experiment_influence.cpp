#include "optim/fit/experiment_influence.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/linear/dense.hpp"
#include "optim/fit/determined_combinations.hpp"
#include "optim/solver/bounded_linear_least_squares.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The same as for the rank of a fit, statistics.cpp: exact derivatives of a simulation carry errors of about 1e-12.
constexpr double kRankTolerance = 1e-8;

// [T | p], of which |T d + p| is to be small, of so many samples with these weighted squares at the solution.
struct Rows {
  MatrixXd T;
  VectorXd p;
  Index samples = 0;
  double squares = 0;
};

// The rows of both, reduced by Q' to as many as d has entries: of the rest |T d + p| does not depend on d.
Rows together(const Rows& a, const Rows& b) {
  const Index n = a.T.cols(), rows = a.T.rows() + b.T.rows();
  MatrixXd all(rows, n + 1);
  all.topLeftCorner(a.T.rows(), n) = a.T, all.topRightCorner(a.T.rows(), 1) = a.p;
  all.bottomLeftCorner(b.T.rows(), n) = b.T, all.bottomRightCorner(b.T.rows(), 1) = b.p;
  if (rows > n) all = triangular_factor(std::move(all)).topRows(n).eval();
  return {all.leftCols(n), all.rightCols(1), a.samples + b.samples, a.squares + b.squares};
}

// argmin |T d + p| within the bounds; infinite where the rows do not determine an entry. The squares: whatever the
// bounds.
OthersWithout least(const Rows& rows, const VectorXd& lower, const VectorXd& upper) {
  const Index n = rows.T.cols();
  VectorXd scale = rows.T.colwise().norm().transpose();  // columns of unit length
  for (double& s : scale) s = s > 0 ? 1 / s : 1;
  const MatrixXd scaled = rows.T * scale.asDiagonal();
  const OrthogonalDecomposition factors(scaled, kRankTolerance);
  VectorXd d = -scale.cwiseProduct(factors.solve(rows.p));
  const double fall = rows.p.squaredNorm() - (rows.p + rows.T * d).squaredNorm();
  if (factors.rank() < n) {
    const std::vector<bool> free = changed_parameters(factors.null_space());
    for (Index k = 0; k < n; ++k)
      if (free[static_cast<std::size_t>(k)]) d(k) = std::numeric_limits<double>::infinity();
  } else if ((d.array() < lower.array()).any() || (d.array() > upper.array()).any()) {
    d = scale.cwiseProduct(
        bounded_linear_least_squares(scaled, -rows.p, lower.cwiseQuotient(scale), upper.cwiseQuotient(scale)));
  }
  return {d, rows.samples, rows.squares, std::max(rows.squares - fall, 0.0)};
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
  const VectorXd w = stack.weights(z).cwiseSqrt(), pull = w.cwiseProduct(z);
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
    J.rightCols(1) = pull(rows_here);
    const MatrixXd R = triangular_factor(std::move(J)).topRows(std::min(rows, columns));
    const Index left = std::max<Index>(R.rows() - own, 0);
    const auto samples = std::ranges::count_if(part.rows, [&](Index row) { return row < stack.samples(); });
    Rows& rest = parts.emplace_back(Rows{MatrixXd::Zero(left, n), R.bottomRows(left).rightCols(1), samples,
                                         pull(part.rows).head(samples).squaredNorm()});
    rest.T(Eigen::all, here) = R.bottomRows(left).middleCols(own, columns - own);
  }
  return {std::move(shared), std::move(priors), std::move(parts)};
}

}  // namespace

std::vector<OthersWithout> others_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                          const std::vector<UnknownParameter>& unknowns,
                                          const std::vector<std::size_t>& group_of_member) {
  const VectorXd& x = solution.x;
  const auto [shared, priors, parts] = shared_rows(stack, solution, unknowns);
  const std::size_t M = group_of_member.size();
  // The rows of all members from m on; those before the group are gathered on the way.
  std::vector<Rows> from(M + 1, priors);
  for (std::size_t m = M; m-- > 0;) from[m] = together(from[m + 1], parts[m]);
  Rows before{MatrixXd(0, priors.T.cols()), VectorXd(0)};
  const VectorXd lower = (stack.x_lower - x)(shared), upper = (stack.x_upper - x)(shared);
  std::vector<OthersWithout> all;
  for (std::size_t m = 0; m < M;) {
    std::size_t end = m;
    while (end < M && group_of_member[end] == group_of_member[m]) ++end;
    OthersWithout& others = all.emplace_back(least(together(before, from[end]), lower, upper));
    const VectorXd change = std::exchange(others.change, VectorXd::Zero(x.size()));
    others.change(shared) = change;
    for (; m < end; ++m) before = together(before, parts[m]);
  }
  return all;
}

}  // namespace mbsopt::inline optim
