// Dense decompositions of matrices of any size. One file compiles them, because each of Eigen's costs ten seconds.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "core/linear/parameter_block.hpp"

namespace mbsopt {

// Eigenvalues of a symmetric matrix, ascending, and the orthonormal eigenvectors as columns.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);
Eigen::Vector3d symmetric_eigenvalues(const Eigen::Matrix3d& A);

// Eigenvalues of a real square matrix, eigenvectors of unit length as columns, and the condition of each eigenvalue. It
// is 1/|w'v| for left and right eigenvectors w, v of unit length (Golub and Van Loan, section 7.2).
struct GeneralEigen {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
  Eigen::VectorXd conditions;
};
GeneralEigen general_eigen(const Eigen::MatrixXd& A);

// Returns w of unit length with w'A = lambda w', for a simple eigenvalue lambda, by inverse iteration.
Eigen::VectorXcd left_eigenvector(const Eigen::MatrixXd& A, std::complex<double> lambda);

// Returns the lower triangular L of A = L L' for a symmetric A; it is empty if A is not positive definite.
Eigen::MatrixXd cholesky_factor(const Eigen::MatrixXd& A);

// Solves A x = b of a symmetric positive definite A by Cholesky.
Eigen::VectorXd cholesky_solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
// Does the same; returns an empty vector if a pivot is not positive, or below this part of the largest.
Eigen::VectorXd definite_solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, double threshold);

// Solves A x = b of a regular complex matrix, and inverts a real one, by elimination with row pivoting.
Eigen::MatrixXcd regular_solve(const Eigen::MatrixXcd& A, const Eigen::MatrixXcd& b);
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A);

// Returns x with the least |A x - b|, by QR with column pivoting. If columns are dependent, x is 0 in some of them.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

// Returns an orthonormal basis of { x : A x = 0 } as columns, by QR of A' with column pivoting. Pivots below
// `threshold` times the largest count as zero.
Eigen::MatrixXd null_space(const Eigen::MatrixXd& A, double threshold);

// Returns a basis of the range of A, whose columns are independent. It is A times the inverse of its triangular factor,
// so that small rows keep their digits.
Eigen::MatrixXd orthonormal_columns(const Eigen::MatrixXd& A);

// A = Q R by Householder's reflections.
Eigen::MatrixXd triangular_factor(Eigen::MatrixXd A);                               // R, of min(rows, columns) rows
Eigen::MatrixXd orthogonal_factor(const Eigen::MatrixXd& A, Eigen::Index columns);  // these first ones of Q

// A = U diag(values) V' with all columns of U and descending values, for small matrices.
struct LeftSingular {
  Eigen::VectorXd values;
  Eigen::MatrixXd U;
};
LeftSingular left_singular(const Eigen::MatrixXd& A);

// The same with all columns of V, and min(rows, columns) values.
struct RightSingular {
  Eigen::VectorXd values;
  Eigen::MatrixXd V;
};
RightSingular right_singular(const Eigen::MatrixXd& A);

// The smallest of the min(rows, columns) singular values of a nonempty A, and its vectors: A v = value u.
struct LeastSingular {
  double value;
  Eigen::VectorXd u, v;
};
LeastSingular least_singular(const Eigen::MatrixXd& A);

// Factors P A = L U of a small square matrix, by elimination with row pivoting. Entries of L that are zero cost
// nothing.
class SquareFactor {
 public:
  bool compute(const Eigen::MatrixXd& A);  // false where A is singular to rounding
  // b becomes the solution of A x = b, or of A'x = b. The _lanes forms take several b as columns.
  void solve(Eigen::Ref<Eigen::VectorXd> b);
  void solve_lanes(Eigen::Ref<LaneRows> b);
  void solve_transposed(Eigen::Ref<Eigen::VectorXd> b);

 private:
  template <class X>
  void solve_permuted(X& x) const;  // x = P b becomes the solution

  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> LU_;  // L below the diagonal
  Eigen::Matrix<Eigen::Index, Eigen::Dynamic, 1> order_;                       // row of A that became row k
  Eigen::VectorXd inverse_pivots_, x_;
  LaneRows lanes_;
};

// The complete orthogonal decomposition A P = Q [T 0; 0 0] Z (Golub and Van Loan, "Matrix Computations", section 5.4).
// Its solutions are the least-squares solutions of least norm, for any rank.
class OrthogonalDecomposition {
 public:
  OrthogonalDecomposition();
  // Pivots below `threshold` times the largest count as zero. If it is negative, rounding alone decides.
  explicit OrthogonalDecomposition(const Eigen::MatrixXd& A, double threshold = -1);
  OrthogonalDecomposition(const OrthogonalDecomposition&);
  OrthogonalDecomposition(OrthogonalDecomposition&&) noexcept;
  OrthogonalDecomposition& operator=(OrthogonalDecomposition) noexcept;
  ~OrthogonalDecomposition();

  void compute(const Eigen::MatrixXd& A, double threshold = -1);  // keeps the storage of a matrix of the same size

  Eigen::Index rank() const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;             // A x = b
  Eigen::MatrixXd solve_transposed(const Eigen::MatrixXd& b) const;  // A'x = b
  Eigen::MatrixXd null_space() const;                                // orthonormal columns x with A x = 0
  Eigen::MatrixXd left_null_space() const;                           // the same of A'

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

}  // namespace mbsopt
