// Nonlinear least-squares problems with published minima: More, Garbow and Hillstrom, ACM Transactions on Mathematical
// Software 7 (1981) 17 (sums of squares at the minimum), and, with bounds, Hock and Schittkowski, "Test Examples for
// Nonlinear Programming Codes" (1981).
#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "optim/solver/least_squares.hpp"
#include "tests/optim/small_programs.hpp"

namespace mbsopt::testing {

struct TestFunction : LeastSquaresProblem {
  using Function = std::function<void(const Eigen::VectorXd& x, Eigen::VectorXd& z, Eigen::MatrixXd& z_x)>;
  TestFunction(std::string title, Eigen::VectorXd start, Eigen::Index residuals, double least, Function function)
      : LeastSquaresProblem(start.size(), residuals),
        name(std::move(title)),
        x0(std::move(start)),
        minimum(least),
        f(std::move(function)) {}
  void evaluate(const Eigen::VectorXd& x, LeastSquaresPoint& p) override { f(x, p.z, p.z_x); }
  std::string name;
  Eigen::VectorXd x0;
  double minimum;  // of the sum of squares
  Function f;
};

inline void rosenbrock_residuals(const Eigen::VectorXd& x, Eigen::VectorXd& z, Eigen::MatrixXd& J) {
  z << 10 * (x(1) - x(0) * x(0)), 1 - x(0);
  J << -20 * x(0), 10, -1, 0;
}

inline TestFunction rosenbrock() { return {"Rosenbrock", vector({-1.2, 1}), 2, 0, rosenbrock_residuals}; }

inline TestFunction freudenstein_roth() {
  return {"Freudenstein and Roth", vector({0.5, -2}), 2, 48.9842, [](const auto& x, auto& z, auto& J) {
            const double y = x(1);
            z << -13 + x(0) + ((5 - y) * y - 2) * y, -29 + x(0) + ((y + 1) * y - 14) * y;
            J << 1, 10 * y - 3 * y * y - 2, 1, 3 * y * y + 2 * y - 14;
          }};
}

inline TestFunction powell_badly_scaled() {
  return {"Powell badly scaled", vector({0, 1}), 2, 0, [](const auto& x, auto& z, auto& J) {
            z << 1e4 * x(0) * x(1) - 1, std::exp(-x(0)) + std::exp(-x(1)) - 1.0001;
            J << 1e4 * x(1), 1e4 * x(0), -std::exp(-x(0)), -std::exp(-x(1));
          }};
}

inline TestFunction brown_badly_scaled() {
  return {"Brown badly scaled", vector({1, 1}), 3, 0, [](const auto& x, auto& z, auto& J) {
            z << x(0) - 1e6, x(1) - 2e-6, x(0) * x(1) - 2;
            J << 1, 0, 0, 1, x(1), x(0);
          }};
}

inline TestFunction beale() {
  return {"Beale", vector({1, 1}), 3, 0, [](const auto& x, auto& z, auto& J) {
            const double y[] = {1.5, 2.25, 2.625};
            for (int i = 0; i < 3; ++i) {
              z(i) = y[i] - x(0) * (1 - std::pow(x(1), i + 1));
              J(i, 0) = std::pow(x(1), i + 1) - 1, J(i, 1) = x(0) * (i + 1) * std::pow(x(1), i);
            }
          }};
}

inline TestFunction jennrich_sampson() {
  return {"Jennrich and Sampson", vector({0.3, 0.4}), 10, 124.362, [](const auto& x, auto& z, auto& J) {
            for (int i = 1; i <= 10; ++i) {
              const double a = std::exp(i * x(0)), b = std::exp(i * x(1));
              z(i - 1) = 2 + 2 * i - (a + b), J(i - 1, 0) = -i * a, J(i - 1, 1) = -i * b;
            }
          }};
}

inline TestFunction kowalik_osborne() {
  return {"Kowalik and Osborne", vector({0.25, 0.39, 0.415, 0.39}), 11, 3.07505e-4,
          [](const auto& x, auto& z, auto& J) {
            const double y[] = {.1957, .1947, .1735, .16, .0844, .0627, .0456, .0342, .0323, .0235, .0246};
            const double u[] = {4, 2, 1, .5, .25, .167, .125, .1, .0833, .0714, .0625};
            for (int i = 0; i < 11; ++i) {
              const double a = u[i] * (u[i] + x(1)), b = u[i] * (u[i] + x(2)) + x(3);
              z(i) = y[i] - x(0) * a / b;
              J(i, 0) = -a / b, J(i, 1) = -x(0) * u[i] / b;
              J(i, 2) = x(0) * a * u[i] / (b * b), J(i, 3) = x(0) * a / (b * b);
            }
          }};
}

inline TestFunction meyer() {
  return {"Meyer", vector({0.02, 4000, 250}), 16, 87.9458, [](const auto& x, auto& z, auto& J) {
            const double y[] = {34780, 28610, 23650, 19630, 16370, 13720, 11540, 9744,
                                8261,  7030,  6005,  5147,  4427,  3820,  3307,  2872};
            for (int i = 0; i < 16; ++i) {
              const double d = 50 + 5 * i + x(2), e = std::exp(x(1) / d);
              z(i) = x(0) * e - y[i];
              J(i, 0) = e, J(i, 1) = x(0) * e / d, J(i, 2) = -x(0) * x(1) * e / (d * d);
            }
          }};
}

inline TestFunction wood() {
  return {"Wood", vector({-3, -1, -3, -1}), 6, 0, [](const auto& x, auto& z, auto& J) {
            const double a = std::sqrt(90.), b = std::sqrt(10.);
            z << 10 * (x(1) - x(0) * x(0)), 1 - x(0), a * (x(3) - x(2) * x(2)), 1 - x(2), b * (x(1) + x(3) - 2),
                (x(1) - x(3)) / b;
            J.setZero();
            J(0, 0) = -20 * x(0), J(0, 1) = 10, J(1, 0) = -1, J(2, 2) = -2 * a * x(2), J(2, 3) = a, J(3, 2) = -1;
            J(4, 1) = J(4, 3) = b, J(5, 1) = 1 / b, J(5, 3) = -1 / b;
          }};
}

inline TestFunction powell_singular() {  // the derivatives at the minimum have rank two
  return {"Powell singular", vector({3, -1, 0, 1}), 4, 0, [](const auto& x, auto& z, auto& J) {
            const double a = x(1) - 2 * x(2), b = x(0) - x(3), s = std::sqrt(5.), t = std::sqrt(10.);
            z << x(0) + 10 * x(1), s * (x(2) - x(3)), a * a, t * b * b;
            J.setZero();
            J(0, 0) = 1, J(0, 1) = 10, J(1, 2) = s, J(1, 3) = -s;
            J(2, 1) = 2 * a, J(2, 2) = -4 * a, J(3, 0) = 2 * t * b, J(3, 3) = -2 * t * b;
          }};
}

inline TestFunction osborne_1() {
  return {"Osborne 1", vector({.5, 1.5, -1, .01, .02}), 33, 5.46489e-5, [](const auto& x, auto& z, auto& J) {
            const double y[] = {.844, .908, .932, .936, .925, .908, .881, .850, .818, .784, .751,
                                .718, .685, .658, .628, .603, .580, .558, .538, .522, .506, .490,
                                .478, .467, .457, .448, .438, .431, .424, .420, .414, .411, .406};
            for (int i = 0; i < 33; ++i) {
              const double t = 10 * i, a = std::exp(-t * x(3)), b = std::exp(-t * x(4));
              z(i) = y[i] - (x(0) + x(1) * a + x(2) * b);
              J(i, 0) = -1, J(i, 1) = -a, J(i, 2) = -b, J(i, 3) = x(1) * t * a, J(i, 4) = x(2) * t * b;
            }
          }};
}

inline std::vector<TestFunction (*)()> test_functions() {
  return {rosenbrock,
          freudenstein_roth,
          powell_badly_scaled,
          brown_badly_scaled,
          beale,
          jennrich_sampson,
          kowalik_osborne,
          meyer,
          wood,
          powell_singular,
          osborne_1};
}

}  // namespace mbsopt::testing
