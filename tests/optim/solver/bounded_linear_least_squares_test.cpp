#include "optim/solver/bounded_linear_least_squares.hpp"

#include <Eigen/QR>
#include <catch2/catch.hpp>
#include <limits>
#include <random>

using namespace mbsopt;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

struct Case {
  MatrixXd A;
  VectorXd b, lower, upper;
  double value(const VectorXd& d) const { return (A * d - b).squaredNorm(); }
};

Case random_case(unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  constexpr Index n = 4;
  Case c{MatrixXd(7, n), VectorXd(7), VectorXd(n), VectorXd(n)};
  for (double& a : c.A.reshaped()) a = normal(generator);
  for (double& b : c.b) b = normal(generator);
  for (Index k = 0; k < n; ++k) {
    const double kind = uniform(generator);  // a variable without bounds, at one of them, between them
    c.lower(k) = kind < 0.2 ? -kNone : kind < 0.5 ? 0 : -0.3 * uniform(generator);
    c.upper(k) = kind < 0.2 ? kNone : kind > 0.8 ? 0 : 0.3 * uniform(generator);
  }
  if (seed % 3 == 0) {  // nearly of rank three
    c.A.col(3) = c.A.col(2);
    for (double& a : c.A.col(3)) a += 1e-7 * normal(generator);
  }
  if (seed % 5 == 0) c.A.col(1) *= 1e8, c.lower(1) *= 1e-8, c.upper(1) *= 1e-8;
  return c;
}

// Each variable free, at its lower or at its upper bound: the best of all 3^n solutions that keep within the bounds.
VectorXd by_enumeration(const Case& c) {
  const Index n = c.A.cols();
  VectorXd best = VectorXd::Zero(n);
  for (int code = 0; code < 81; ++code) {
    VectorXd d = VectorXd::Zero(n);
    std::vector<Index> free;
    int digits = code;
    bool possible = true;
    for (Index k = 0; k < n; ++k, digits /= 3) {
      if (digits % 3 == 0) free.push_back(k);
      if (digits % 3 == 1) d(k) = c.lower(k);
      if (digits % 3 == 2) d(k) = c.upper(k);
      possible = possible && std::isfinite(d(k));
    }
    if (!possible) continue;
    MatrixXd A(c.A.rows(), static_cast<Index>(free.size()));
    for (std::size_t i = 0; i < free.size(); ++i) A.col(static_cast<Index>(i)) = c.A.col(free[i]);
    if (!free.empty()) {
      const VectorXd y = A.colPivHouseholderQr().solve(c.b - c.A * d);
      for (std::size_t i = 0; i < free.size(); ++i) d(free[i]) = y(static_cast<Index>(i));
    }
    const bool within = (d.array() >= c.lower.array()).all() && (d.array() <= c.upper.array()).all();
    if (within && c.value(d) < c.value(best)) best = d;
  }
  return best;
}

}  // namespace

TEST_CASE("bounded least squares: no choice of held variables does better", "[bounded]") {
  for (unsigned seed = 0; seed < 300; ++seed) {
    const Case c = random_case(seed);
    const VectorXd d = bounded_linear_least_squares(c.A, c.b, c.lower, c.upper);
    INFO("seed " << seed);
    CHECK((d.array() >= c.lower.array()).all());
    CHECK((d.array() <= c.upper.array()).all());
    CHECK(c.value(d) <= c.value(by_enumeration(c)) * (1 + 1e-8));  // rounding, times the condition number 1e7
  }
}

TEST_CASE("bounded least squares without bounds is least squares", "[bounded]") {
  const Case c = random_case(1);
  const VectorXd none = VectorXd::Constant(4, kNone);
  const VectorXd d = bounded_linear_least_squares(c.A, c.b, -none, none);
  CHECK((d - c.A.householderQr().solve(c.b)).norm() < 1e-12);
}

TEST_CASE("a bound whose multiplier is zero holds or not, the solution is the same", "[bounded]") {
  const MatrixXd A = MatrixXd::Identity(3, 3);
  const VectorXd b = (VectorXd(3) << 0, 1, 2).finished();  // the first at its bound, the second ends on one
  const VectorXd lower = VectorXd::Zero(3), upper = VectorXd::Ones(3);
  CHECK(bounded_linear_least_squares(A, b, lower, upper) == (VectorXd(3) << 0, 1, 1).finished());
}

TEST_CASE("variables that cannot move stay", "[bounded]") {
  const MatrixXd A = MatrixXd::Identity(2, 2);
  const VectorXd b = VectorXd::Ones(2), zero = VectorXd::Zero(2);
  CHECK(bounded_linear_least_squares(A, b, zero, zero) == zero);
}

TEST_CASE("non-negative least squares: against all subsets of columns", "[bounded]") {
  std::srand(GENERATE(range(1u, 30u)));
  const MatrixXd A = MatrixXd::Random(5, 4);
  const VectorXd b = VectorXd::Random(5);
  const VectorXd none = VectorXd::Constant(4, kNone), z = bounded_linear_least_squares(A, b, VectorXd::Zero(4), none);
  CHECK(z.minCoeff() >= 0);
  double least = b.norm();
  for (unsigned subset = 1; subset < 16; ++subset) {
    MatrixXd part(5, 0);
    for (int j = 0; j < 4; ++j) {
      if (!(subset >> j & 1u)) continue;
      part.conservativeResize(5, part.cols() + 1);
      part.rightCols(1) = A.col(j);
    }
    const VectorXd s = part.colPivHouseholderQr().solve(b);
    if (s.minCoeff() >= 0) least = std::min(least, (part * s - b).norm());
  }
  CHECK((A * z - b).norm() == Approx(least).epsilon(1e-10));
}

TEST_CASE("bounded least squares of many parts: free variables have no gradient, held ones are pressed on their bounds",
          "[bounded]") {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  constexpr Index parts = 40, n = 2 * parts + 2;  // two columns of each part, two that all share
  MatrixXd A = MatrixXd::Zero(5 * parts, n);
  for (Index part = 0; part < parts; ++part)
    for (Index row = 5 * part; row < 5 * part + 5; ++row)
      for (const Index column : {2 * part, 2 * part + 1, n - 2, n - 1}) A(row, column) = normal(generator);
  VectorXd b(A.rows()), bounds(n);
  for (double& value : b) value = normal(generator);
  for (double& bound : bounds) bound = 0.2 * std::abs(normal(generator));
  const VectorXd none = VectorXd::Constant(n, kNone);
  CHECK((bounded_linear_least_squares(A, b, -none, none) - A.householderQr().solve(b)).norm() < 1e-12);
  const VectorXd d = bounded_linear_least_squares(A, b, -bounds, bounds), gradient = A.transpose() * (A * d - b);
  for (Index k = 0; k < n; ++k) {
    CHECK(std::abs(d(k)) <= bounds(k));
    if (d(k) > -bounds(k)) CHECK(gradient(k) < 1e-12);
    if (d(k) < bounds(k)) CHECK(gradient(k) > -1e-12);
  }
}
