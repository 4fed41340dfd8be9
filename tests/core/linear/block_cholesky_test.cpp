#include "core/linear/block_cholesky.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <random>

using namespace mbsopt;

namespace {

// A connected random graph with a few cycles, its matrix S = I + sum over edges of a random positive part, dense as
// well.
struct Case {
  BlockCholesky<6> S;
  Eigen::MatrixXd dense;

  Case(int bodies, int extra_edges, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::pair<int, int>> edges;
    for (int i = 1; i < bodies; ++i) edges.emplace_back(i, static_cast<int>(random() % static_cast<unsigned>(i)));
    for (int k = 0; k < extra_edges; ++k) {
      const int i = static_cast<int>(random() % static_cast<unsigned>(bodies));
      const int j = static_cast<int>(random() % static_cast<unsigned>(bodies));
      if (i != j) edges.emplace_back(i, j);
    }
    S = BlockCholesky<6>(bodies, edges);
    S.set_zero();
    dense = Eigen::MatrixXd::Identity(6 * bodies, 6 * bodies);
    for (int i = 0; i < bodies; ++i) S.diagonal(i).setIdentity();
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const auto [i, j] = edges[k];
      const Mat<5, 6> a = Mat<5, 6>::Random(), b = Mat<5, 6>::Random();
      S.diagonal(i) += a.transpose() * a;
      S.diagonal(j) += b.transpose() * b;
      S.add_off_diagonal(k, a.transpose() * b);
      dense.block<6, 6>(6 * i, 6 * i) += a.transpose() * a;
      dense.block<6, 6>(6 * j, 6 * j) += b.transpose() * b;
      dense.block<6, 6>(6 * i, 6 * j) += a.transpose() * b;
      dense.block<6, 6>(6 * j, 6 * i) += b.transpose() * a;
    }
  }
};

}  // namespace

TEST_CASE("block Cholesky solves like a dense Cholesky on chains, trees and graphs with loops", "[dynamics]") {
  const unsigned seed = GENERATE(range(0u, 6u));
  const int bodies = 1 + 3 * static_cast<int>(seed);
  Case c(bodies, static_cast<int>(seed), seed);
  REQUIRE(c.S.factor());
  std::vector<Vec<6>> x(static_cast<std::size_t>(bodies));
  std::vector<Lanes<6>> X(static_cast<std::size_t>(bodies));
  Eigen::MatrixXd b = Eigen::MatrixXd::Random(6 * bodies, kLanes);
  for (int i = 0; i < bodies; ++i) {
    x[static_cast<std::size_t>(i)] = b.col(0).segment<6>(6 * i);
    X[static_cast<std::size_t>(i)] = b.middleRows<6>(6 * i);
  }
  c.S.solve(std::span<Vec<6>>(x));
  c.S.solve(std::span<Lanes<6>>(X));
  const Eigen::MatrixXd expected = c.dense.llt().solve(b);
  double worst = 0;
  for (int i = 0; i < bodies; ++i) {
    worst = std::max(worst, (x[static_cast<std::size_t>(i)] - expected.col(0).segment<6>(6 * i)).cwiseAbs().maxCoeff());
    worst = std::max(worst, (X[static_cast<std::size_t>(i)] - expected.middleRows<6>(6 * i)).cwiseAbs().maxCoeff());
  }
  CHECK(worst < 1e-12);
}

TEST_CASE("a chain is factored without fill", "[dynamics]") {
  std::vector<std::pair<int, int>> edges;
  for (int i = 1; i < 50; ++i) edges.emplace_back(i - 1, i);
  CHECK(BlockCholesky<6>(50, edges).fill_blocks() == 49);
}

TEST_CASE("a matrix that is not positive definite is refused", "[dynamics]") {
  BlockCholesky<6> S(2, std::vector<std::pair<int, int>>{{0, 1}});
  S.set_zero();
  S.diagonal(0).setIdentity();
  S.diagonal(1).setIdentity();
  S.add_off_diagonal(0, 2 * Mat<6, 6>::Identity());
  CHECK_FALSE(S.factor());
}
