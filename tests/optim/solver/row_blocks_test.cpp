#include "optim/solver/row_blocks.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

#include "optim/solver/bounded_linear_least_squares.hpp"

using namespace mbsopt;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd random_matrix(Index rows, Index columns, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  MatrixXd A(rows, columns);
  for (double& a : A.reshaped()) a = normal(generator);
  return A;
}

// Three windows with two columns of their own and two that all share, and a row for one shared column alone.
RowBlocks bordered(std::mt19937& generator) {
  std::vector<RowBlock> blocks;
  for (Index w = 0; w < 3; ++w) blocks.push_back({{2 * w + 2, 0, 1, 2 * w + 3}, random_matrix(5, 4, generator)});
  blocks.push_back({{1}, random_matrix(1, 1, generator)});
  return {blocks, 8};
}

MatrixXd dense(const RowBlocks& A) {
  MatrixXd all = MatrixXd::Zero(16, A.columns());
  Index row = 0;
  for (const RowBlock& block : A.blocks()) {
    all(Eigen::seqN(row, block.A.rows()), block.columns) = block.A;
    row += block.A.rows();
  }
  return all;
}

}  // namespace

TEST_CASE("blocks of rows: products and solutions are those of the whole matrix", "[row_blocks]") {
  std::mt19937 generator(5);
  const RowBlocks A = bordered(generator);
  const MatrixXd all = dense(A);
  const VectorXd b = random_matrix(16, 1, generator), d = random_matrix(8, 1, generator);
  CHECK((A * d - all * d).norm() < 1e-13);
  CHECK((A.transposed_times(b) - all.transpose() * b).norm() < 1e-13);
  CHECK((A.column_norms().transpose() - all.colwise().norm()).norm() < 1e-13);
  const std::vector<Index> sets[] = {{0, 1, 2, 3, 4, 5, 6, 7}, {7, 1, 3, 4}, {2, 5}, {0}};
  for (const std::vector<Index>& free : sets) {
    VectorXd expected = VectorXd::Zero(8);
    expected(free) = all(Eigen::all, free).householderQr().solve(b);
    CHECK((A.solve(b, free) - expected).norm() < 1e-12);
  }
}

TEST_CASE("blocks of rows: damping adds a row per column", "[row_blocks]") {
  std::mt19937 generator(6);
  const RowBlocks A = bordered(generator);
  const VectorXd b = random_matrix(16, 1, generator), D = random_matrix(8, 1, generator).cwiseAbs();
  const RowBlocks damped = A.scaled_and_damped(D, 0.25);
  MatrixXd all(24, 8);
  all << dense(A) * D.cwiseInverse().asDiagonal(), 0.5 * MatrixXd::Identity(8, 8);
  VectorXd longer = VectorXd::Zero(24);
  longer.head(16) = b;
  CHECK((damped.solve(longer, {0, 1, 2, 3, 4, 5, 6, 7}) - all.householderQr().solve(longer)).norm() < 1e-12);
}

TEST_CASE("blocks of rows: the solution within bounds is that of the whole matrix", "[row_blocks]") {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 generator(seed);
    const RowBlocks A = bordered(generator);
    const VectorXd b = random_matrix(16, 1, generator);
    VectorXd lower = -0.2 * random_matrix(8, 1, generator).cwiseAbs(), upper = -lower;
    lower(seed % 8) = -kNone, upper(seed % 7) = kNone;
    const VectorXd d = bounded_linear_least_squares(A, b, lower, upper);
    CHECK((d - bounded_linear_least_squares(dense(A), b, lower, upper)).norm() < 1e-12);
  }
}

TEST_CASE("blocks of rows: columns shared by neighbours leave the chain one by one", "[row_blocks]") {
  std::mt19937 generator(7);
  std::vector<RowBlock> blocks;
  for (Index w = 0; w < 5; ++w) {  // two columns per link, and the last one shared by all
    RowBlock block{{2 * w + 1, 2 * w, 12}, random_matrix(6, 3, generator)};
    if (w < 4) block = {{2 * w, 2 * w + 1, 12, 2 * w + 3, 2 * w + 2}, random_matrix(6, 5, generator)};
    blocks.push_back(block);
  }
  const RowBlocks A(blocks, 13);  // columns 10 and 11 are nowhere
  MatrixXd all = MatrixXd::Zero(30, 13);
  for (std::size_t w = 0; w < 5; ++w) all(Eigen::seqN(6 * static_cast<Index>(w), 6), blocks[w].columns) = blocks[w].A;
  const VectorXd b = random_matrix(30, 1, generator);
  const std::vector<Index> sets[] = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 12}, {12, 3, 8, 5}, {2, 5, 6}};
  for (const std::vector<Index>& free : sets) {
    VectorXd expected = VectorXd::Zero(13);
    expected(free) = all(Eigen::all, free).householderQr().solve(b);
    CHECK((A.solve(b, free) - expected).norm() < 1e-12);
  }
}
