#include "core/tableau/tableaus.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <string>

#include "tests/core/tableau/rooted_trees.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using ComplexPoint = std::complex<double>;

namespace {

// What double precision leaves of an order condition: rounded coefficients, and rounding in the sums of the test.
constexpr double kBound = 5e-15;
// Weights of dense output are larger: up to 600 in dopri853, 88 in tsit5, 40 in verner6.
// Those of rodas4 come from published numbers of 16 digits.
double dense_bound(const Method& rk) {
  return rk.name == "dopri853" ? 1e-11 : rk.name == "rodas4" ? 2e-13 : rk.name == "tsit5" ? 1e-13 : 3e-14;
}

struct StabilityFunction {  // R(z) = 1 + z b'(I - z A)^-1 1
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  explicit StabilityFunction(const Method& rk) : A(rk.stages, rk.stages), b(rk.stages) {
    for (int i = 0; i < rk.stages; ++i) {
      b(i) = rk.b[i];
      for (int j = 0; j < rk.stages; ++j) A(i, j) = rk.beta(i, j);
    }
  }
  ComplexPoint operator()(ComplexPoint z) const {
    const Eigen::Index n = A.rows();
    const Eigen::MatrixXcd M = Eigen::MatrixXcd::Identity(n, n) - z * A.cast<ComplexPoint>();
    const Eigen::VectorXcd x = M.partialPivLu().solve(Eigen::VectorXcd::Ones(n));
    ComplexPoint sum = 1;
    for (Eigen::Index i = 0; i < n; ++i) sum += z * b(i) * x(i);
    return sum;
  }
};

}  // namespace

TEST_CASE("there are 1, 1, 2, 4, 9, 20, 48, 115, 286 rooted trees of one to nine nodes", "[tableau]") {
  std::vector<int> count(10, 0);
  for (const RootedTree& tree : rooted_trees(9)) ++count[static_cast<std::size_t>(tree.order)];
  CHECK(count == std::vector<int>{0, 1, 1, 2, 4, 9, 20, 48, 115, 286});
}

TEST_CASE("every tableau meets the order conditions of all rooted trees up to its order", "[tableau]") {
  const std::vector<RootedTree> trees = rooted_trees(9);
  for (const Method& rk : runge_kutta_methods()) {
    const std::vector<std::vector<double>> weights = elementary_weights(rk, trees);
    double beyond = 0;
    for (std::size_t k = 0; k < trees.size(); ++k) {
      const double right = 1 / trees[k].gamma;
      const double r = order_condition(
          rk.stages, [&](int i) { return rk.b[i]; }, weights[k], right);
      INFO(std::string(rk.name) << ", tree " << k << " of " << trees[k].order << " nodes");
      if (trees[k].order <= rk.order) {
        CHECK(std::abs(r) <= kBound);
      } else if (trees[k].order == rk.order + 1) {
        beyond = std::max(beyond, std::abs(r) / right);
      }
    }
    INFO(std::string(rk.name));
    CHECK(beyond > 1e-3);  // and not one order more
  }
}

TEST_CASE("the error estimate vanishes up to one order below its own, and not at its own", "[tableau]") {
  const std::vector<RootedTree> trees = rooted_trees(6);
  for (const Method& rk : runge_kutta_methods()) {
    if (!rk.adaptive) {
      CHECK(rk.error_order == 0);
      continue;
    }
    const std::vector<std::vector<double>> weights = elementary_weights(rk, trees);
    // The order of h sum_i error_i k_i: the first with a tree that does not vanish.
    const auto order_of = [&](const double* error) {
      for (std::size_t k = 0; k < trees.size(); ++k) {
        const double r = order_condition(
            rk.stages, [&](int i) { return error[i]; }, weights[k], 0);
        if (std::abs(r) > 1e-4 / trees[k].gamma) return trees[k].order;
        INFO(std::string(rk.name) << ", tree " << k << " of " << trees[k].order << " nodes");
        CHECK(std::abs(r) <= kBound);
      }
      return 0;
    };
    INFO(std::string(rk.name));
    // DOP853 combines two: err5^2 / sqrt(err5^2 + 0.01 err3^2), O(h^(2*6 - 4)).
    const int order = rk.error_low ? 2 * order_of(rk.error) - order_of(rk.error_low) : order_of(rk.error);
    CHECK(order == rk.error_order);
  }
}

// y' = lambda y, z = h lambda: K = inv(I - z A) lambda y0.
TEST_CASE("the error estimate does not vanish on linear motion", "[tableau]") {
  for (const Method& rk : runge_kutta_methods()) {
    if (!rk.adaptive) continue;
    const ComplexPoint z(0, 0.5);
    Eigen::MatrixXcd matrix = Eigen::MatrixXcd::Identity(rk.stages, rk.stages);
    Eigen::RowVectorXcd error(rk.stages);
    for (int i = 0; i < rk.stages; ++i) {
      error(i) = rk.error[i];
      for (int j = 0; j < rk.stages; ++j) matrix(i, j) -= z * rk.beta(i, j);
    }
    const Eigen::VectorXcd K = matrix.lu().solve(Eigen::VectorXcd::Ones(rk.stages));
    INFO(std::string(rk.name));
    CHECK(std::abs(z * (error * K)(0)) > 1e-6 * std::pow(std::abs(z), rk.error_order));
  }
}

TEST_CASE("dense output meets all order conditions for each power of theta", "[tableau]") {
  const std::vector<RootedTree> trees = rooted_trees(7);
  for (const Method& rk : runge_kutta_methods()) {
    INFO(std::string(rk.name));
    CHECK(rk.dense_order >= rk.order - 1);
    CHECK(rk.dense_order <= 7);
    const std::vector<std::vector<double>> weights = elementary_weights(rk, trees);
    for (std::size_t k = 0; k < trees.size() && trees[k].order <= rk.dense_order; ++k) {
      for (int power = 1; power <= 7; ++power) {
        const double right = trees[k].order == power ? 1 / trees[k].gamma : 0.0;
        const auto weight = [&](int i) { return rk.dense[7 * i + power - 1]; };
        const double r = order_condition(rk.dense_stages, weight, weights[k], right);
        INFO("tree " << k << " of " << trees[k].order << " nodes, theta^" << power);
        CHECK(std::abs(r) <= dense_bound(rk));
      }
    }
    for (int i = 0; i < rk.dense_stages; ++i) {
      double size = 1;
      for (int j = 0; j < 7; ++j) size += std::abs(rk.dense[7 * i + j]);
      CHECK(std::abs(rk.dense_weight(i, 1.0) - (i < rk.stages ? rk.b[i] : 0.0)) <= 4e-16 * size);
    }
  }
}

TEST_CASE("stages are grouped by what they need of each other", "[tableau]") {
  const auto sizes = [](std::string_view name) {
    std::vector<int> list;
    for (const StageGroup& g : runge_kutta_method(name)->stage_groups()) list.push_back(g.size());
    return list;
  };
  CHECK(sizes("rk4") == std::vector<int>{1, 1, 1, 1});
  CHECK(sizes("sdirk4") == std::vector<int>{1, 1, 1, 1, 1, 1});
  CHECK(sizes("radau5") == std::vector<int>{1, 3});
  CHECK(sizes("lobatto3c") == std::vector<int>{1, 3});
  CHECK(sizes("radau1a") == std::vector<int>{1, 3, 1});
  CHECK(sizes("gauss4") == std::vector<int>{1, 2, 1});
  CHECK(sizes("gauss6") == std::vector<int>{1, 3, 1, 1});
  CHECK(runge_kutta_method("gauss6")->stage_groups_of_step().size() == 3);
  CHECK(runge_kutta_method("dopri853")->stage_groups_of_step().size() == 12);
  for (const Method& rk : runge_kutta_methods()) {
    INFO(std::string(rk.name));
    int next = 0;
    for (const StageGroup& g : rk.stage_groups()) {
      CHECK(g.first == next);
      next = g.last + 1;
      for (int i = g.first; i <= g.last; ++i) {
        for (int j = next; j < rk.dense_stages; ++j) CHECK(rk.a(i, j) == 0);
      }
    }
    CHECK(next == rk.dense_stages);
    CHECK(rk.stage_groups_of_step().back().last == rk.stages - 1);
  }
}

TEST_CASE("explicit methods have explicit stages only; implicit ones start with f(y0)", "[tableau]") {
  for (const Method& rk : explicit_methods()) {
    INFO(std::string(rk.name));
    CHECK_FALSE(rk.implicit());
    CHECK_FALSE(rk.stiffly_accurate);
    CHECK(rk.error_filter == 0);
  }
  for (const Method& rk : implicit_methods()) {
    INFO(std::string(rk.name));
    CHECK(rk.implicit());
    CHECK(rk.adaptive);
    CHECK(rk.is_explicit_stage(0));
    if (rk.gamma) continue;
    CHECK_FALSE(rk.is_explicit_stage(1));
    CHECK(rk.error_filter > 0);
    for (int i = rk.stages; i < rk.dense_stages; ++i) CHECK(rk.is_explicit_stage(i));
  }
}

TEST_CASE("implicit methods are A-stable: R has its poles on the right and |R(iy)| <= 1", "[tableau]") {
  for (const Method& rk : implicit_methods()) {
    const StabilityFunction R(rk);
    INFO(std::string(rk.name));
    const Eigen::VectorXcd poles = R.A.eigenvalues();  // of their inverses; 0 for an explicit stage
    CHECK(poles.real().minCoeff() > -1e-14);
    for (double exponent = -3; exponent <= 7; exponent += 0.01) {
      const ComplexPoint z(0, std::pow(10, exponent));
      INFO("z = " << z);
      CHECK(std::abs(R(z)) <= 1 + 1e-12);
    }
  }
}

TEST_CASE("all implicit methods but Gauss's are L-stable, and stiffly accurate but for radau1a", "[tableau]") {
  for (const Method& rk : implicit_methods()) {
    INFO(std::string(rk.name));
    const bool gauss = rk.name.substr(0, 5) == "gauss";
    const double at_infinity = std::abs(StabilityFunction(rk)(-1e6));
    CHECK(at_infinity == Approx(gauss ? 1 : 0).margin(1e-4));
    CHECK(rk.stiffly_accurate == (!gauss && rk.name != "radau1a"));
    // The filter's matrix is one that a stage has: an eigenvalue of A, but for gauss4, which has no real one.
    if (rk.name == "gauss4" || rk.gamma) continue;
    const Eigen::VectorXcd eigenvalues = StabilityFunction(rk).A.eigenvalues();
    CHECK((eigenvalues.array() - rk.error_filter).abs().minCoeff() < 1e-3);  // 1e-3: multiple ones spread
  }
}

TEST_CASE("implicit methods have stage order 2 at least, but for Rosenbrock methods", "[tableau]") {
  for (const Method& rk : implicit_methods()) {
    if (rk.gamma) continue;
    for (int i = 0; i < rk.stages; ++i) {
      double sum = 0;
      for (int j = 0; j < rk.stages; ++j) sum += rk.a(i, j) * rk.c[j];
      INFO(std::string(rk.name) << ", stage " << i);
      CHECK(std::abs(sum - 0.5 * rk.c[i] * rk.c[i]) < 1e-15);
    }
  }
}

// E. Hairer's code RODAS and A. Sandu's FATODE print the same sums.
TEST_CASE("a Rosenbrock method has one gamma, and its running costs have a rule of its order", "[tableau]") {
  const Method& rk = *runge_kutta_method("rodas4");
  REQUIRE(rk.gamma);
  for (int i = 0; i < rk.stages; ++i) {
    double sum = 0;
    for (int j = 0; j < rk.stages; ++j) {
      sum += rk.gamma_of(i, j);
      if (j > i) CHECK(rk.gamma_of(i, j) == 0);
    }
    CHECK(rk.gamma_of(i, i) == 0.25);
    CHECK(std::abs(sum - rk.gamma_sum[i]) < kBound);
  }
  for (int power = 0; power < 6; ++power) {
    double sum = 0;
    for (int m = 0; m < rk.nodes; ++m) sum += rk.node_b[m] * std::pow(rk.node_c[m], power);
    CHECK(std::abs(sum - 1.0 / (power + 1)) < kBound);
  }
  for (const Method& other : runge_kutta_methods()) {
    if (other.gamma) continue;
    CHECK((other.nodes == other.stages && other.node_b == other.b && other.node_c == other.c));
  }
}

TEST_CASE("methods are found by name only", "[tableau]") {
  REQUIRE(explicit_method("dopri5"));
  CHECK(explicit_method("dopri5")->order == 5);
  CHECK(explicit_method("Dopri5") == nullptr);
  CHECK(explicit_method("radau5") == nullptr);
  REQUIRE(runge_kutta_method("radau5"));
  CHECK(runge_kutta_method("radau5")->order == 5);
  CHECK(explicit_methods().size() + implicit_methods().size() == runge_kutta_methods().size());
  CHECK_FALSE(explicit_methods().back().implicit());
  CHECK(implicit_methods().front().implicit());
}
