#include "core/integrate/tableaus.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace mbsopt;

namespace {

double power(double x, int k) { return k == 0 ? 1.0 : std::pow(x, k); }

// sum_i b_i (A^depth c^k)_i over the stages of the step
double tree(const Method& rk, int depth, int k) {
  std::vector<double> x(static_cast<std::size_t>(rk.dense_stages));
  for (int i = 0; i < rk.dense_stages; ++i) x[static_cast<std::size_t>(i)] = power(rk.c[i], k);
  for (int d = 0; d < depth; ++d) {
    std::vector<double> next(x.size(), 0.0);
    for (int i = 0; i < rk.dense_stages; ++i) {
      for (int j = 0; j < i; ++j) next[static_cast<std::size_t>(i)] += rk.a(i, j) * x[static_cast<std::size_t>(j)];
    }
    x = next;
  }
  double sum = 0;
  for (int i = 0; i < rk.stages; ++i) sum += rk.b[i] * x[static_cast<std::size_t>(i)];
  return sum;
}

}  // namespace

TEST_CASE("every tableau meets the order conditions of quadrature and of its tall trees", "[tableau]") {
  for (const Method& rk : explicit_methods()) {
    INFO(std::string(rk.name));
    // b'A^d c^k = k!/(k + d + 1)!  for k + d + 1 <= order: Hairer, Norsett, Wanner I, section II.2
    for (int depth = 0; depth < rk.order; ++depth) {
      for (int k = 0; k + depth + 1 <= rk.order; ++k) {
        double expected = 1;
        for (int j = k + 1; j <= k + depth + 1; ++j) expected /= j;
        CHECK(std::abs(tree(rk, depth, k) - expected) < 5e-15);
      }
    }
  }
}

TEST_CASE("no tableau exceeds its order: the next quadrature or tall tree fails", "[tableau]") {
  for (const Method& rk : explicit_methods()) {
    INFO(std::string(rk.name));
    double worst = 0;
    for (int depth = 0; depth <= rk.order; ++depth) {
      const int k = rk.order - depth;
      double expected = 1;
      for (int j = k + 1; j <= k + depth + 1; ++j) expected /= j;
      worst = std::max(worst, std::abs(tree(rk, depth, k) - expected));
    }
    CHECK(worst > 1e-7);
  }
}

TEST_CASE("dense output integrates powers of time exactly up to its order", "[tableau]") {
  for (const Method& rk : explicit_methods()) {
    INFO(std::string(rk.name));
    for (const double theta : {0.1, 0.37, 0.5, 0.9, 1.0}) {
      for (int k = 0; k < rk.dense_order; ++k) {
        double sum = 0;
        for (int i = 0; i < rk.dense_stages; ++i) sum += rk.dense_weight(i, theta) * power(rk.c[i], k);
        CHECK(std::abs(sum - std::pow(theta, k + 1) / (k + 1)) < 1e-12);
      }
    }
  }
}

TEST_CASE("error weights sum to zero, so that a constant slope has no error", "[tableau]") {
  for (const Method& rk : explicit_methods()) {
    double sum = 0;
    for (int i = 0; i < rk.stages; ++i) sum += rk.error[i];
    CHECK(std::abs(sum) < 1e-14);
  }
}

TEST_CASE("methods are found by name only", "[tableau]") {
  REQUIRE(explicit_method("dopri5"));
  CHECK(explicit_method("dopri5")->order == 5);
  CHECK(explicit_method("Dopri5") == nullptr);
}
