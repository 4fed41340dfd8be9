#include "core/linear/sparse_lu.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;
using Eigen::MatrixXd;

namespace {

// A sparse pattern with repeated entries; values from a seed.
struct Sample {
  int size = 12;
  std::vector<SparseLu::Entry> entries;
  std::vector<double> values;
  MatrixXd dense;
  explicit Sample(double seed) {
    for (int i = 0; i < size; ++i) {
      for (const int j : {i, (i + 1) % size, (5 * i + 3) % size, i}) entries.push_back({i, j});
    }
    dense.setZero(size, size);
    for (std::size_t k = 0; k < entries.size(); ++k) {
      values.push_back(std::sin(seed + 1.7 * static_cast<double>(k)) + (k % 4 == 0 ? 2 : 0));
      dense(entries[k].row, entries[k].column) += values.back();
    }
  }
  void put_into(SparseLu& lu) const {
    std::fill(lu.values().begin(), lu.values().end(), 0.0);
    for (std::size_t k = 0; k < entries.size(); ++k) lu.values()[lu.slot(k)] += values[k];
  }
};

}  // namespace

TEST_CASE("a sparse factor solves with the matrix and its transpose, again and again for new values", "[sparse_lu]") {
  SparseLu lu(12, Sample(0).entries);
  for (const double seed : {0.0, 1.0, 2.5}) {
    const Sample s(seed);
    s.put_into(lu);
    REQUIRE(lu.factor());
    const MatrixXd b = MatrixXd::Random(12, 3);
    MatrixXd x = b;
    lu.solve(x);
    CHECK((s.dense * x - b).norm() < 1e-12);
    x = b;
    lu.solve_transposed(x);
    CHECK((s.dense.transpose() * x - b).norm() < 1e-12);
  }
}

TEST_CASE("pivots that do not serve new values are chosen anew", "[sparse_lu]") {
  SparseLu lu(2, {{0, 0}, {0, 1}, {1, 0}, {1, 1}});
  auto solve = [&](double a, double b, double c, double d) {
    lu.values() = {a, c, b, d};  // by columns
    REQUIRE(lu.factor());
    MatrixXd x(2, 1);
    x << a + 2 * b, c + 2 * d;
    lu.solve(x);
    CHECK(x(0) == Approx(1).epsilon(1e-12));
    CHECK(x(1) == Approx(2).epsilon(1e-12));
  };
  solve(1, 2, 3, 4);
  solve(0, 1, 1, 0);
  solve(1e-20, 1, 1, 1);
}

TEST_CASE("a singular matrix and one that is not finite are refused", "[sparse_lu]") {
  SparseLu lu(2, {{0, 0}, {0, 1}, {1, 0}, {1, 1}});
  lu.values() = {1, 2, 2, 4};
  CHECK_FALSE(lu.factor());
  lu.values() = {1, NAN, 2, 4};
  CHECK_FALSE(lu.factor());
  lu.values() = {1, 2, 3, 4};
  CHECK(lu.factor());
}
