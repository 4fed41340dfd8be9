#include "optim/fit/experiment_influence.hpp"

#include <algorithm>
#include <limits>

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

// The experiments tell this of the shared variables: |T d + p| is to be small.
struct SharedRows {
  MatrixXd T_p;                     // [T | p]
  std::vector<std::size_t> member;  // of each row; that of priors is none
};

SharedRows shared_rows(const ExperimentStack& stack, const LeastSquaresResult& solution,
                       const std::vector<Index>& shared) {
  const MatrixXd& z_x = solution.point.z_x;
  const VectorXd w = stack.weights(solution.point.z).cwiseSqrt();
  const Index n = std::ssize(shared);
  SharedRows all{MatrixXd(0, n + 1), {}};
  const auto rows_of = [&](const std::vector<Index>& rows, const std::vector<Index>& columns) {
    MatrixXd J(std::ssize(rows), std::ssize(columns) + 1);
    J << z_x(rows, columns), solution.point.z(rows);
    return MatrixXd(w(rows).asDiagonal() * J);
  };
  const auto add = [&](const MatrixXd& rows, std::size_t member) {
    all.T_p.conservativeResize(all.T_p.rows() + rows.rows(), Eigen::NoChange);
    all.T_p.bottomRows(rows.rows()) = rows;
    all.member.resize(all.member.size() + static_cast<std::size_t>(rows.rows()), member);
  };
  for (std::size_t m = 0; m < stack.parts.size(); ++m) {
    std::vector<Index> columns, rows, priors;  // columns: its own variables, then the shared ones
    for (const Index k : stack.parts[m].variables)
      if (!stack.unknowns()[static_cast<std::size_t>(k)].shared && !stack.is_at_bound(solution.x, k))
        columns.push_back(k);
    const Index own = std::ssize(columns);
    columns.insert(columns.end(), shared.begin(), shared.end());
    for (const Index row : stack.parts[m].rows)
      (row >= stack.samples() && !z_x(row, shared).isZero(0) ? priors : rows).push_back(row);
    if (!priors.empty()) add(rows_of(priors, shared), stack.members().size());
    if (rows.empty()) continue;
    // The last row of the factor, below all columns, does not depend on d.
    const MatrixXd R = triangular_factor(rows_of(rows, columns)).topRows(std::min(std::ssize(rows), own + n));
    add(R.bottomRightCorner(std::max<Index>(R.rows() - own, 0), n + 1), m);
  }
  return all;
}

// argmin |T d + p| within the bounds; infinite where the rows do not determine an entry. fall: of the squares, whatever
// the bounds.
VectorXd least(const MatrixXd& T_p, const VectorXd& lower, const VectorXd& upper, double& fall) {
  const Index n = T_p.cols() - 1;
  const MatrixXd T = T_p.leftCols(n);
  const VectorXd p = T_p.rightCols(1);
  const VectorXd scale = T.colwise().norm().transpose().unaryExpr([](double s) { return s > 0 ? 1 / s : 1; });
  const MatrixXd scaled = T * scale.asDiagonal();  // columns of unit length
  const OrthogonalDecomposition factors(scaled, kRankTolerance);
  VectorXd d = -scale.cwiseProduct(factors.solve(p));
  fall = p.squaredNorm() - (p + T * d).squaredNorm();
  if (factors.rank() < n) {
    const std::vector<bool> free = changed_parameters(factors.null_space());
    for (Index k = 0; k < n; ++k)
      if (free[static_cast<std::size_t>(k)]) d(k) = std::numeric_limits<double>::infinity();
  } else if ((d.array() < lower.array()).any() || (d.array() > upper.array()).any()) {
    d = scale.cwiseProduct(
        bounded_linear_least_squares(scaled, -p, lower.cwiseQuotient(scale), upper.cwiseQuotient(scale)));
  }
  return d;
}

}  // namespace

std::vector<OthersWithout> others_without(const ExperimentStack& stack, const LeastSquaresResult& solution,
                                          const std::vector<std::size_t>& group_of_member) {
  const VectorXd& x = solution.x;
  std::vector<Index> shared;
  for (const UnknownParameter& unknown : stack.unknowns())
    if (unknown.shared) shared.push_back(&unknown - stack.unknowns().data());
  const SharedRows rows = shared_rows(stack, solution, shared);
  const VectorXd lower = (stack.x_lower - x)(shared), upper = (stack.x_upper - x)(shared);
  const VectorXd squares = stack.weights(solution.point.z).cwiseProduct(solution.point.z.cwiseAbs2());
  std::vector<OthersWithout> all(group_of_member.back() + 1);
  for (std::size_t g = 0; g < all.size(); ++g) {
    std::vector<Index> kept;
    for (std::size_t row = 0; row < rows.member.size(); ++row)
      if (rows.member[row] == group_of_member.size() || group_of_member[rows.member[row]] != g)
        kept.push_back(static_cast<Index>(row));
    OthersWithout& others = all[g];
    double fall = 0;
    others.change.setZero(x.size());
    others.change(shared) = least(rows.T_p(kept, Eigen::all), lower, upper, fall);
    Index first = 0;
    for (std::size_t m = 0; m < group_of_member.size(); ++m) {
      const Index n = static_cast<Index>(stack.members()[m].model.samples().size());
      if (group_of_member[m] != g) others.samples += n, others.before += squares.segment(first, n).sum();
      first += n;
    }
    others.after = std::max(others.before - fall, 0.0);
  }
  return all;
}

}  // namespace mbsopt::inline optim
