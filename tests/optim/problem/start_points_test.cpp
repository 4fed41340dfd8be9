#include "optim/problem/start_points.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>

using namespace mbsopt;

namespace {

// Centred L2 discrepancy, squared (Hickernell, Mathematics of Computation 67 (1998) 299-322, eq. 5.1).
double discrepancy(const Eigen::MatrixXd& X) {
  const double n = static_cast<double>(X.cols());
  double one = 0, two = 0;
  for (Eigen::Index i = 0; i < X.cols(); ++i) {
    double p = 1;
    for (Eigen::Index k = 0; k < X.rows(); ++k) {
      const double a = std::abs(X(k, i) - 0.5);
      p *= 1 + a / 2 - a * a / 2;
    }
    one += p;
    for (Eigen::Index j = 0; j < X.cols(); ++j) {
      double q = 1;
      for (Eigen::Index k = 0; k < X.rows(); ++k)
        q *= 1 + (std::abs(X(k, i) - 0.5) + std::abs(X(k, j) - 0.5) - std::abs(X(k, i) - X(k, j))) / 2;
      two += q;
    }
  }
  return std::pow(13.0 / 12, static_cast<double>(X.rows())) - 2 / n * one + two / (n * n);
}

Parameter parameter(const std::string& name, double value, double lower, double upper,
                    ParameterScale scale = ParameterScale::linear) {
  Parameter p;
  p.name = name, p.value = value, p.lower = lower, p.upper = upper, p.scale = scale;
  return p;
}

}  // namespace

TEST_CASE("a Latin hypercube has one point in every slice of every variable", "[start_points]") {
  const Eigen::MatrixXd X = unit_points(StartSampling::latin_hypercube, 4, 23, GENERATE(0, 1, 77));
  for (Eigen::Index k = 0; k < 4; ++k) {
    std::set<long> slices;
    for (const double u : X.row(k)) slices.insert(static_cast<long>(u * 23));
    CHECK(slices.size() == 23);
    CHECK(*slices.rbegin() == 22);
  }
  CHECK(X.row(0) != X.row(1));
}

TEST_CASE("Sobol points fill the cube more evenly than random ones would", "[start_points]") {
  const Eigen::Index n = 64, d = 3;
  const Eigen::MatrixXd X = unit_points(StartSampling::sobol, d, n, GENERATE(1, 2, 3));
  CHECK((X.array() >= 0).all());
  CHECK((X.array() < 1).all());
  // Independent points: ((5/4)^d - (13/12)^d)/n on average.
  const double of_random = (std::pow(1.25, d) - std::pow(13.0 / 12, d)) / static_cast<double>(n);
  CHECK(discrepancy(X) < of_random / 3);
  CHECK(discrepancy(unit_points(StartSampling::latin_hypercube, d, n, 1)) < of_random);
}

TEST_CASE("points depend on the seed and the kind, and on nothing else", "[start_points]") {
  const auto kind = GENERATE(StartSampling::latin_hypercube, StartSampling::sobol);
  CHECK(unit_points(kind, 3, 10, 5) == unit_points(kind, 3, 10, 5));
  CHECK(unit_points(kind, 3, 10, 5) != unit_points(kind, 3, 10, 6));
  CHECK(unit_points(StartSampling::sobol, 3, 10, 5) != unit_points(StartSampling::latin_hypercube, 3, 10, 5));
}

TEST_CASE("starts: first the given values, the others within the bounds, logarithms evenly", "[start_points]") {
  MultistartSpec spec;
  spec.starts = 101;
  const auto starts =
      start_values({parameter("L", 2, 1, 3), parameter("k", 50, 1, 1e4, ParameterScale::log10)}, spec, 9);
  REQUIRE(starts.size() == 101);
  CHECK(starts[0](0) == 2);
  CHECK(starts[0](1) == 50);
  int below_100 = 0;
  for (const Eigen::VectorXd& rho : starts) {
    CHECK((rho(0) >= 1 && rho(0) <= 3 && rho(1) >= 1 && rho(1) <= 1e4));
    below_100 += rho(1) < 100;
  }
  CHECK(below_100 == 51);  // half of the decades, and the given one
}
