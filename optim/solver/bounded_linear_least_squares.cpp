#include "optim/solver/bounded_linear_least_squares.hpp"

#include <Eigen/SparseQR>
#include <algorithm>
#include <vector>

#include "core/linear/dense.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using SparseMatrix = Eigen::SparseMatrix<double>;

constexpr Index kDense = 60;     // columns, up to which a dense decomposition costs less
constexpr double kZero = 1e-13;  // of a gradient, relative to its column and to b: rounding of some hundred products

// The solution in these columns.
VectorXd solution_in(const SparseMatrix& A, const VectorXd& b, const std::vector<Index>& columns) {
  if (A.cols() <= kDense) return least_squares(MatrixXd(A)(Eigen::all, columns), b);
  SparseMatrix taken(A.rows(), static_cast<Index>(columns.size()));
  for (Index j = 0; j < taken.cols(); ++j) {
    taken.startVec(j);
    for (SparseMatrix::InnerIterator entry(A, columns[static_cast<std::size_t>(j)]); entry; ++entry)
      taken.insertBack(entry.row(), j) = entry.value();
  }
  taken.finalize();
  return Eigen::SparseQR<SparseMatrix, Eigen::COLAMDOrdering<int>>(taken).solve(b);
}

class ActiveSet {
 public:
  ActiveSet(const SparseMatrix& A, const VectorXd& b, const VectorXd& lower, const VectorXd& upper)
      : A_(A), b_(b), lower_(lower), upper_(upper), d_(VectorXd::Zero(A.cols())) {
    const VectorXd g = gradient();
    for (Index k = 0; k < d_.size(); ++k)
      if (!pushes_out(k, g(k))) free_.push_back(k);
  }

  VectorXd solve() {
    // Each turn holds or releases a variable. Only rounding could let them alternate.
    for (Index turn = 0; turn < 10 * d_.size() + 10; ++turn)
      if (reach_solution_of_free() && !release()) break;
    return d_;
  }

 private:
  VectorXd gradient() const { return A_.transpose() * VectorXd(A_ * d_ - b_); }
  // Returns whether the variable is at a bound beyond which the sum would fall. A variable with equal bounds cannot
  // move.
  bool pushes_out(Index k, double g) const {
    return (d_(k) <= lower_(k) && g > 0) || (d_(k) >= upper_(k) && g < 0) || lower_(k) >= upper_(k);
  }

  // Moves to the solution of the free variables, or as far as the first bound. Returns whether it reached the solution.
  bool reach_solution_of_free() {
    if (free_.empty()) return true;
    const Index n = static_cast<Index>(free_.size());
    VectorXd others = d_;
    for (Index i = 0; i < n; ++i) others(at(i)) = 0;
    const VectorXd solution = solution_in(A_, b_ - A_ * others, free_);
    VectorXd parts = VectorXd::Constant(n, 1);  // of the way to the solution, up to its bound
    for (Index i = 0; i < n; ++i) {
      const double from = d_(at(i)), to = solution(i);
      if (to < lower_(at(i))) parts(i) = (lower_(at(i)) - from) / (to - from);
      if (to > upper_(at(i))) parts(i) = (upper_(at(i)) - from) / (to - from);
    }
    const double part = parts.minCoeff();
    std::vector<Index> left;
    for (Index i = 0; i < n; ++i) {
      const Index k = at(i);
      const bool held = part < 1 && parts(i) <= part;
      if (held)
        d_(k) = solution(i) < d_(k) ? lower_(k) : upper_(k);
      else
        d_(k) = std::clamp(d_(k) + part * (solution(i) - d_(k)), lower_(k), upper_(k)), left.push_back(k);
    }
    free_ = std::move(left);
    return part >= 1;
  }

  bool release() {
    const VectorXd g = gradient();
    const VectorXd lengths = b_.norm() * column_norms(A_);
    Index best = -1;
    double most = kZero;
    for (Index k = 0; k < d_.size(); ++k) {
      if (std::ranges::find(free_, k) != free_.end() || pushes_out(k, g(k))) continue;
      if (const double inward = lengths(k) > 0 ? std::abs(g(k)) / lengths(k) : 0; inward > most) {
        most = inward;
        best = k;
      }
    }
    if (best < 0) return false;
    free_.push_back(best);
    return true;
  }

  Index at(Index i) const { return free_[static_cast<std::size_t>(i)]; }

  const SparseMatrix& A_;
  const VectorXd &b_, &lower_, &upper_;
  VectorXd d_;
  std::vector<Index> free_;
};

}  // namespace

VectorXd column_norms(const SparseMatrix& A) {
  const VectorXd squares = A.cwiseAbs2().transpose() * VectorXd::Ones(A.rows());
  return squares.cwiseSqrt();
}

VectorXd bounded_linear_least_squares(const SparseMatrix& A, const VectorXd& b, const VectorXd& lower,
                                      const VectorXd& upper) {
  return ActiveSet(A, b, lower, upper).solve();
}

VectorXd bounded_linear_least_squares(const MatrixXd& A, const VectorXd& b, const VectorXd& lower,
                                      const VectorXd& upper) {
  return bounded_linear_least_squares(SparseMatrix(A.sparseView()), b, lower, upper);
}

}  // namespace mbsopt::inline optim
