// The names that the C++ examples of the docs take for granted.
#pragma once

#include <iostream>
#include <memory>
#include <vector>

#include "core/cvodes/cvodes.hpp"
#include "core/expression/program.hpp"
#include "core/force/user_force.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/problem/problem.hpp"

using namespace mbsopt;

struct MyRunningCost final : RunningCost {
  double g(double, VecIn y, VecIn) const override { return y.squaredNorm(); }
  void add_g_y(double, VecIn y, VecIn, double scale, VecOut out) const override { out += 2 * scale * y; }
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
};
struct MyTerminalCost final : TerminalCost {
  double value(VecIn y, VecIn) const override { return y(0); }
  void adjoint_init(VecIn, VecIn, VecOut lambda, VecOut mu) const override {
    lambda.setZero(), lambda(0) = 1, mu.setZero();
  }
};
using SquareOfX = MyRunningCost;
using ScaledEnd = MyTerminalCost;

struct Given {
  const Problem& problem;
  const Mechanism& mechanism;
  const std::vector<Cost>& costs;
  const Eigen::VectorXd &rho, &d;
};
#define UNPACK(given)                                            \
  [[maybe_unused]] const Problem& problem = given.problem;       \
  [[maybe_unused]] const Scene& scene = given.problem.scene;     \
  [[maybe_unused]] const Mechanism& mechanism = given.mechanism; \
  [[maybe_unused]] const std::vector<Cost>& costs = given.costs; \
  [[maybe_unused]] const Eigen::VectorXd &rho = given.rho, &d = given.d;
