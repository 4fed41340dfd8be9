// Nonlinear programs with known solutions.
#pragma once

#include <cmath>
#include <initializer_list>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "optim/solver/nonlinear_program.hpp"

namespace mbsopt::testing {

inline Eigen::VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

// Writes down every point it is asked for, and for what.
struct Counted : NonlinearProgram {
  using NonlinearProgram::NonlinearProgram;
  virtual double f(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::VectorXd f_x(const Eigen::VectorXd& x) const = 0;
  virtual void constraints_at(const Eigen::VectorXd&, Eigen::VectorXd&, Eigen::MatrixXd*) const {}
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    asked.push_back(x), ++gradients;
    p.f = f(x), p.f_x = f_x(x);
    constraints_at(x, p.c, &p.c_x);
  }
  void evaluate_values(const Eigen::VectorXd& x, NlpPoint& p) override {
    asked.push_back(x), ++values;
    p.f = f(x);
    constraints_at(x, p.c, nullptr);
  }
  // The largest number of times that one point was computed.
  int most_often() const {
    std::map<std::vector<double>, int> count;
    int most = 0;
    for (const Eigen::VectorXd& x : asked) most = std::max(most, ++count[{x.begin(), x.end()}]);
    return most;
  }
  std::vector<Eigen::VectorXd> asked;
  int gradients = 0, values = 0;
};

struct Rosenbrock : Counted {
  Rosenbrock() : Counted(2, 0) { x_lower.setConstant(-2), x_upper.setConstant(2); }
  double f(const Eigen::VectorXd& x) const override {
    return std::pow(1 - x(0), 2) + 100 * std::pow(x(1) - x(0) * x(0), 2);
  }
  Eigen::VectorXd f_x(const Eigen::VectorXd& x) const override {
    const double b = x(1) - x(0) * x(0);
    return vector({-2 * (1 - x(0)) - 400 * x(0) * b, 200 * b});
  }
};

// Hock and Schittkowski, "Test Examples for Nonlinear Programming Codes" (1981), problem 71: f = 17.0140172891563.
struct Hs071 : Counted {
  explicit Hs071(bool with_equality = true) : Counted(4, 2) {
    x_lower.setConstant(1), x_upper.setConstant(5);
    c_lower(0) = 25, c_upper(1) = 40;
    if (with_equality) c_lower(1) = 40;  // it holds at the solution either way
  }
  double f(const Eigen::VectorXd& x) const override { return x(0) * x(3) * (x(0) + x(1) + x(2)) + x(2); }
  Eigen::VectorXd f_x(const Eigen::VectorXd& x) const override {
    return vector({x(3) * (2 * x(0) + x(1) + x(2)), x(0) * x(3), x(0) * x(3) + 1, x(0) * (x(0) + x(1) + x(2))});
  }
  void constraints_at(const Eigen::VectorXd& x, Eigen::VectorXd& c, Eigen::MatrixXd* c_x) const override {
    c << x.prod(), x.squaredNorm();
    if (!c_x) return;
    c_x->row(0) << x(1) * x(2) * x(3), x(0) * x(2) * x(3), x(0) * x(1) * x(3), x(0) * x(1) * x(2);
    c_x->row(1) = 2 * x.transpose();
  }
  static constexpr double kMinimum = 17.0140172891563;
  static Eigen::VectorXd solution() { return vector({1, 4.74299963, 3.82114998, 1.37940829}); }
};

// Six-hump camel back (Dixon and Szego 1978): six local minima, two of them global with f = -1.0316284534898774 at
// +-(0.0898420, -0.7126564).
struct Camel : Counted {
  Camel() : Counted(2, 0) { x_lower << -3, -2, x_upper << 3, 2; }
  double f(const Eigen::VectorXd& x) const override {
    const double a = x(0) * x(0), b = x(1) * x(1);
    return (4 - 2.1 * a + a * a / 3) * a + x(0) * x(1) + (4 * b - 4) * b;
  }
  Eigen::VectorXd f_x(const Eigen::VectorXd& x) const override {
    const double u = x(0), w = x(1);
    return vector({8 * u - 8.4 * u * u * u + 2 * std::pow(u, 5) + w, u - 8 * w + 16 * w * w * w});
  }
  static constexpr double kMinimum = -1.0316284534898774;
};

// f = 50 (x - log x) + (y - 1)^2, minimum at (1, 1), evaluable for 0.5 <= x only. The first steps from 4 go too far.
struct Fragile : Counted {
  Fragile() : Counted(2, 0) { x_lower.setConstant(-10), x_upper.setConstant(10); }
  double f(const Eigen::VectorXd& x) const override {
    if (x(0) < 0.5 && throws) throw std::runtime_error("the crank locks");
    if (x(0) < 0.5) return std::nan("");
    return 50 * (x(0) - std::log(x(0))) + (x(1) - 1) * (x(1) - 1);
  }
  Eigen::VectorXd f_x(const Eigen::VectorXd& x) const override { return vector({50 - 50 / x(0), 2 * (x(1) - 1)}); }
  bool throws = true;
};

}  // namespace mbsopt::testing
