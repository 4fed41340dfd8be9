#include "core/linear/dense.hpp"

#include <catch2/catch.hpp>
#include <utility>

#include "core/linear/parameter_block.hpp"

using namespace mbsopt;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Rank 2 in three rows and four columns: the third row is the sum of the others.
MatrixXd rank_two() {
  MatrixXd A(3, 4);
  A << 1, 2, 0, -1, 0, 1, 3, 1, 1, 3, 3, 0;
  return A;
}

double largest(const MatrixXd& x) { return x.size() == 0 ? 0 : x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(); }

}  // namespace

TEST_CASE("a complete orthogonal decomposition meets the four conditions of the pseudo-inverse", "[linear]") {
  const MatrixXd A = rank_two();
  const OrthogonalDecomposition decomposition(A, 1e-10);
  CHECK(decomposition.rank() == 2);
  const MatrixXd X = decomposition.solve(MatrixXd::Identity(3, 3));
  CHECK(largest(A * X * A - A) < 1e-14);
  CHECK(largest(X * A * X - X) < 1e-14);
  CHECK(largest(A * X - (A * X).transpose()) < 1e-14);
  CHECK(largest(X * A - (X * A).transpose()) < 1e-14);
  CHECK(largest(decomposition.solve_transposed(MatrixXd::Identity(4, 4)) - X.transpose()) < 1e-14);
}

TEST_CASE("a decomposition that is computed again is that of the new matrix and threshold", "[linear]") {
  MatrixXd A = rank_two();
  OrthogonalDecomposition decomposition(MatrixXd::Ones(3, 4), 0.5);
  CHECK(decomposition.rank() == 1);
  decomposition.compute(A, 1e-10);
  CHECK(decomposition.rank() == 2);
  CHECK(decomposition.left_null_space() == OrthogonalDecomposition(A, 1e-10).left_null_space());
  A(2, 3) = 1e-9;
  decomposition.compute(A);  // by rounding alone
  CHECK(decomposition.rank() == 3);
  decomposition.compute(MatrixXd::Identity(5, 5));
  CHECK(decomposition.rank() == 5);
  CHECK(decomposition.left_null_space().cols() == 0);
}

TEST_CASE("null spaces are orthonormal and have the dimension that the rank leaves", "[linear]") {
  const MatrixXd A = rank_two(), N = null_space(A, 1e-10);
  CHECK(N.cols() == 2);
  CHECK(largest(A * N) < 1e-14);
  CHECK(largest(N.transpose() * N - MatrixXd::Identity(2, 2)) < 1e-14);
  const MatrixXd left = OrthogonalDecomposition(A, 1e-10).left_null_space();
  CHECK(left.cols() == 1);
  CHECK(largest(A.transpose() * left) < 1e-14);
  CHECK(null_space(MatrixXd(0, 3), 1e-10).isIdentity());
}

TEST_CASE("symmetric eigenvalues ascend and rebuild the matrix; left singular vectors belong to A A'", "[linear]") {
  const MatrixXd A = rank_two(), S = A * A.transpose();
  const SymmetricEigen eigen = symmetric_eigen(S);
  CHECK(largest(eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - S) < 1e-13);
  CHECK((eigen.values(0) <= eigen.values(1) && eigen.values(1) <= eigen.values(2)));
  CHECK(largest(symmetric_eigenvalues(S) - eigen.values) < 1e-13);
  const LeftSingular svd = left_singular(A);
  CHECK(largest(svd.U.transpose() * S * svd.U - MatrixXd(svd.values.cwiseAbs2().asDiagonal())) < 1e-12);
  CHECK(left_singular(MatrixXd(0, 2)).values.size() == 0);
}

TEST_CASE("an orthogonal decomposition without rows or columns solves what there is", "[linear]") {
  for (const auto& [rows, cols] : {std::pair{0, 0}, std::pair{3, 0}, std::pair{0, 3}}) {
    const OrthogonalDecomposition A(MatrixXd(rows, cols));
    CHECK(A.rank() == 0);
    CHECK(A.solve(MatrixXd::Ones(rows, 2)) == MatrixXd::Zero(cols, 2));
    CHECK(A.solve_transposed(MatrixXd::Ones(cols, 2)) == MatrixXd::Zero(rows, 2));
    CHECK(A.left_null_space() == MatrixXd::Identity(rows, rows));
  }
}

TEST_CASE("cholesky solves a symmetric positive definite system", "[linear]") {
  const MatrixXd A = rank_two() * rank_two().transpose() + MatrixXd::Identity(3, 3);
  const VectorXd x = VectorXd::LinSpaced(3, 1, 2);
  CHECK(largest(cholesky_solve(A, A * x) - x) < 1e-13);
}

TEST_CASE("factors of a square matrix with zeros solve with it and with its transpose, and refuse a singular one",
          "[linear]") {
  MatrixXd A(4, 4);
  A << 0, 2, 0, 1, 1, 0, 0, 0, 0, 3, -1, 0, 4, 0, 0, 5;
  SquareFactor factor;
  REQUIRE(factor.compute(A));
  const VectorXd b = VectorXd::LinSpaced(4, 1, 7);
  VectorXd x = b, y = b;
  factor.solve(x);
  CHECK(largest(A * x - b) < 1e-14);
  factor.solve_transposed(y);
  CHECK(largest(A.transpose() * y - b) < 1e-14);
  LaneRows lanes = LaneRows::Random(4, kLanes);
  const LaneRows right = lanes;
  factor.solve_lanes(lanes);
  CHECK(largest(A * lanes - right) < 1e-14);
  A.row(3) = A.row(0) + A.row(2);
  CHECK_FALSE(factor.compute(A));
}
