#include "optim/fit/determined_combinations.hpp"

#include <Eigen/SVD>
#include <catch2/catch.hpp>

using namespace mbsopt;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using Words = std::vector<std::string>;

MatrixXd row(double a, double b, double c) {
  MatrixXd m(1, 3);
  m << a, b, c;
  return m;
}

// What is said where only the given functions are measured, from their gradients at rho (rows).
Words words_for(const MatrixXd& gradients, const VectorXd& rho, const Words& names, const Words& units = {}) {
  const VectorXd size = (rho.array() == 0).select(1.0, rho.cwiseAbs());
  const MatrixXd scaled = gradients * size.asDiagonal();
  const Eigen::JacobiSVD<MatrixXd> svd(scaled, Eigen::ComputeFullV);
  const Eigen::Index rank = (svd.singularValues().array() > 1e-10).count();
  // Mixed, so that no direction is a nice one.
  MatrixXd null_space = svd.matrixV().rightCols(rho.size() - rank);
  for (Eigen::Index c = 1; c < null_space.cols(); ++c) null_space.col(c) += 0.3 * null_space.col(c - 1);
  return determined_combinations(null_space, rho, size, names, units);
}

}  // namespace

TEST_CASE("a product of powers is named, whatever the sizes of its factors", "[identifiability]") {
  VectorXd rho(3);
  rho << 0.147, 9.81, 3.3e-3;
  const Words names{"a", "g", "J"};
  // f = a g/J: f_rho/f = (1/a, 1/g, -1/J)
  MatrixXd f(1, 3);
  f << 1 / rho(0), 1 / rho(1), -1 / rho(2);
  CHECK(words_for(f, rho, names) == Words{"a, g, J: only a*g/J is determined"});
  f << 2 / rho(0), 1 / rho(1), -1 / rho(2);
  CHECK(words_for(f, rho, names) == Words{"a, g, J: only a^2*g/J is determined"});
  f << -0.5 / rho(0), 0.5 / rho(1), -1 / rho(2);  // from sqrt(g/a)/J
  CHECK(words_for(f, rho, names) == Words{"a, g, J: only a*J^2/g is determined"});
  f << 1 / rho(0), -1 / rho(1), -1 / rho(2);
  CHECK(words_for(f, rho, names) == Words{"a, g, J: only a/(g*J) is determined"});
}

TEST_CASE("sums, differences and other combinations are named", "[identifiability]") {
  VectorXd rho(3);
  rho << 2, 3, 5;
  const Words names{"m1", "m2", "m3"};
  CHECK(words_for(row(1, 1, 1), rho, names) == Words{"m1, m2, m3: only m1 + m2 + m3 is determined"});
  CHECK(words_for(row(1, 1, -1), rho, names) == Words{"m1, m2, m3: only m1 + m2 - m3 is determined"});
  CHECK(words_for(row(1, 0.3, -0.7), rho, names) == Words{"m1, m2, m3: only m1 + 0.3*m2 - 0.7*m3 is determined"});
  VectorXd with_zero(3);
  with_zero << 2, 0, 5;  // a product says nothing there
  CHECK(words_for(row(1, 0.5, 0.4), with_zero, names) == Words{"m1, m2, m3: only m1 + 0.5*m2 + 0.4*m3 is determined"});
}

TEST_CASE("parameters of different units are not added up", "[identifiability]") {
  // m a is measured, and both are 1: to first order m + a is as good, but for its units.
  const VectorXd ones = VectorXd::Ones(2);
  MatrixXd direction(2, 1);
  direction << 1, -1;
  CHECK(determined_combinations(direction, ones, ones, {"m", "a"}) == Words{"m, a: only m + a is determined"});
  CHECK(determined_combinations(direction, ones, ones, {"m", "a"}, {"kg", "kg"}) ==
        Words{"m, a: only m + a is determined"});
  CHECK(determined_combinations(direction, ones, ones, {"m", "a"}, {"kg", ""}) ==
        Words{"m, a: only m + a is determined"});
  CHECK(determined_combinations(direction, ones, ones, {"m", "a"}, {"kg", "m"}) ==
        Words{"m, a: only m*a is determined"});
}

TEST_CASE("several combinations of one group, and several groups", "[identifiability]") {
  VectorXd rho(4);
  rho << 0.5, 0.1, 4e-4, 7e-3;
  MatrixXd f(2, 4);
  f << 1 / 0.5, 1 / 0.1, 0, -1 / 7e-3,  // m a/J
      0, 0, 1 / 4e-4, -1 / 7e-3;        // k/J
  CHECK(words_for(f, rho, {"m", "a", "k", "J"}) == Words{"m, a, k, J: only m*a/J and k/J are determined"});
  f << 1, 1, 0, 0, 0, 0, 1 / 4e-4, 1 / 7e-3;
  CHECK(words_for(f, rho, {"m", "a", "k", "J"}) ==
        Words{"m, a: only m + a is determined", "k, J: only k*J is determined"});
  f << 1, 1, 0, 0, 0, 0, 1, 0;
  CHECK(words_for(f, rho, {"m", "a", "k", "J"}) ==
        Words{"m, a: only m + a is determined", "J: does not influence what is measured"});
}

TEST_CASE("parameters that no direction changes stay out of it", "[identifiability]") {
  MatrixXd direction = MatrixXd::Zero(3, 1);
  direction(0, 0) = 1, direction(2, 0) = -1;
  CHECK(changed_parameters(direction) == std::vector<bool>{true, false, true});
  CHECK(changed_parameters(MatrixXd(3, 0)) == std::vector<bool>{false, false, false});
  CHECK(determined_combinations(MatrixXd(3, 0), VectorXd::Ones(3), VectorXd::Ones(3), {"a", "b", "c"}).empty());
}

TEST_CASE("base parameters of an arm are named as sums of products", "[identifiability]") {
  const double m1 = 2.1, a1 = 0.037, I1 = 0.013, m2 = 0.83, a2 = 0.19, I2 = 0.021, l1 = 0.2;
  VectorXd rho(6);
  rho << m1, a1, I1, m2, a2, I2;
  const Words names{"m1", "a1", "I1", "m2", "a2", "I2"}, units{"kg", "m", "kg m^2", "kg", "m", "kg m^2"};
  MatrixXd f(4, 6);
  f << a1, m1, 0, l1, 0, 0,                    // m1 a1 + m2 l1
      a1 * a1, 2 * m1 * a1, 1, l1 * l1, 0, 0,  // I1 + m1 a1^2 + m2 l1^2
      0, 0, 0, a2, m2, 0,                      // m2 a2
      0, 0, 0, a2 * a2, 2 * m2 * a2, 1;        // I2 + m2 a2^2
  CHECK(words_for(f, rho, names, units) ==
        Words{"m1, a1, I1, m2, a2, I2: only m2*a2, I2 + m2*a2^2, m1*a1 + 0.2*m2 and I1 + m1*a1^2 + 0.04*m2 are "
              "determined"});
  CHECK(words_for(f.bottomRightCorner(2, 3), rho.tail(3), {"m", "a", "I"}, {"kg", "m", "kg m^2"}) ==
        Words{"m, a, I: only m*a and I + m*a^2 are determined"});
}
