#include "core/linear/block_lu.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

using namespace mbsopt;
using Eigen::Index;
using Eigen::MatrixXd;

namespace {

// A matrix on a connected random graph with a few cycles, in parts of 7 x 7, dense as well. Not symmetric.
struct GraphCase {
  int rows, bodies;
  std::vector<std::pair<int, int>> edges;
  BlockLu lu;
  MatrixXd dense;

  static std::vector<std::pair<int, int>> graph(int bodies, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::pair<int, int>> edges;
    for (int i = 1; i < bodies; ++i) edges.emplace_back(i, static_cast<int>(random() % static_cast<unsigned>(i)));
    for (unsigned k = 0; k < seed; ++k) {
      const int i = static_cast<int>(random() % static_cast<unsigned>(bodies));
      const int j = static_cast<int>(random() % static_cast<unsigned>(bodies));
      if (i != j) edges.emplace_back(i, j);
    }
    return edges;
  }

  GraphCase(int size, int count, unsigned seed, const LuKernelTable& kernels)
      : rows(size), bodies(count), edges(graph(count, seed)), lu(size, count, edges, kernels) {
    fill();
  }
  void fill() {
    lu.set_zero();
    dense.setZero(rows * bodies, rows * bodies);
    for (int i = 0; i < bodies; ++i) add(i, i, 10);
    for (const auto& [i, j] : edges) add(i, j, 0), add(j, i, 0);
  }
  void add(int row, int column, double diagonal) {
    for (Index i = 0; i < rows; i += 7) {
      for (Index j = 0; j < rows; j += 7) {
        Eigen::Matrix<double, 7, 7> x = Eigen::Matrix<double, 7, 7>::Random();
        if (i == j) x += diagonal * Eigen::Matrix<double, 7, 7>::Identity();
        lu.add(lu.handle(row, column), i, j, x);
        dense.block<7, 7>(row * rows + i, column * rows + j) += x;
      }
    }
  }
  MatrixXd padded(const MatrixXd& b) const {
    MatrixXd x = MatrixXd::Zero(bodies * lu.stride(), b.cols());
    for (int i = 0; i < bodies; ++i) x.middleRows(i * lu.stride(), rows) = b.middleRows(i * rows, rows);
    return x;
  }
};

// What the processor at hand chooses from.
std::vector<const LuKernelTable*> all_lu_kernels() {
  std::vector<const LuKernelTable*> all{&portable_lu_kernels()};
  if (avx2_lu_kernels()) all.push_back(avx2_lu_kernels());
  return all;
}

}  // namespace

TEST_CASE("block LU solves with a matrix and its transpose like a dense LU, again and again for new values",
          "[block_lu]") {
  const int rows = GENERATE(7, 14, 21, 28);
  const unsigned seed = GENERATE(range(0u, 5u));
  const LuKernelTable* const kernels = GENERATE(from_range(all_lu_kernels()));
  GraphCase c(rows, 1 + 3 * static_cast<int>(seed), seed, *kernels);
  for (int repeat = 0; repeat < 2; ++repeat) {
    REQUIRE(c.lu.factor());
    const MatrixXd b = MatrixXd::Random(rows * c.bodies, 3);
    MatrixXd x = c.padded(b);
    c.lu.solve(x);
    CHECK((x - c.padded(c.dense.lu().solve(b))).norm() < 1e-11 * b.norm());
    x = c.padded(b);
    c.lu.solve_transposed(x);
    CHECK((x - c.padded(c.dense.transpose().lu().solve(b))).norm() < 1e-11 * b.norm());
    c.fill();
  }
}

TEST_CASE("rows are exchanged within a diagonal block", "[block_lu]") {
  const std::vector<std::pair<int, int>> edges{{0, 1}};
  BlockLu lu(7, 2, edges);
  lu.set_zero();
  Eigen::Matrix<double, 7, 7> backwards = Eigen::Matrix<double, 7, 7>::Identity().rowwise().reverse();
  for (const int body : {0, 1}) lu.add(lu.handle(body, body), 0, 0, backwards);
  REQUIRE(lu.factor());
  MatrixXd x = MatrixXd::Zero(2 * lu.stride(), 1);
  x(0) = 3, x(lu.stride() + 2) = 5;
  lu.solve(x);
  CHECK(x(6) == 3);
  CHECK(x(lu.stride() + 4) == 5);
}

TEST_CASE("a zero pivot and a number that is none are refused", "[block_lu]") {
  const std::vector<std::pair<int, int>> edges{{0, 1}};
  BlockLu lu(7, 2, edges);
  lu.set_zero();
  const Eigen::Matrix<double, 7, 7> one = Eigen::Matrix<double, 7, 7>::Identity();
  lu.add(lu.handle(0, 1), 0, 0, one);
  lu.add(lu.handle(1, 0), 0, 0, one);
  CHECK_FALSE(lu.factor());  // regular, but not without exchanging the bodies' rows
  lu.set_zero();
  lu.add(lu.handle(0, 0), 0, 0, one);
  lu.add(lu.handle(1, 1), 0, 0, Eigen::Matrix<double, 7, 7>::Constant(NAN));
  CHECK_FALSE(lu.factor());
}
