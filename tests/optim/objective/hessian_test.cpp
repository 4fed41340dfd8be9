#include "optim/objective/hessian.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "optim/problem/parameter_values.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Catch::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kEnd = 2;  // [s]

// A free body under a constant force:  x(t) = v0 t + F/(2 m) t^2. No integrator of order 4 or more has an error here.
Problem free_body(const std::string& integrator) {
  Problem p;
  Scene& s = p.scene;
  s.gravity = {0.0, 0.0, 0.0};
  testing::add_parameters(s, {{"m", 1.7}, {"F", 3.1}, {"v0", -0.4}});
  Body b;
  b.name = "body", b.mass = testing::f("m"), b.inertia = {0.2, 0.3, 0.4, 0.0, 0.0, 0.0};
  b.velocity = testing::vec("v0", "0", "0");
  s.bodies = {b};
  PointForce push;
  push.body = "body", push.components = testing::vec("F", "0", "0");
  s.forces = {{"push", push}};
  s.sensors = {testing::point_sensor("x", "position", "body", "O", "x")};
  s.simulation.end_time = kEnd;
  s.simulation.integrator.type = integrator;
  ObjectiveSpec end, square, mean;
  end.name = "end", end.terminal = testing::f("x"), end.parameters_only = testing::f("m^2*F + exp(v0)");
  square.name = "square", square.terminal = testing::f("x^2");
  mean.name = "mean", mean.running = testing::f("x"), mean.samples = {{1.0, testing::f("m*x")}};
  p.objectives = {end, square, mean};
  return p;
}

// c1 v0 + c2 F/m and its derivatives in (m, F, v0).
struct Rational {
  double value;
  Eigen::Vector3d gradient;
  Eigen::Matrix3d hessian;
  Rational(double c1, double c2, double m, double F, double v0) {
    value = c1 * v0 + c2 * F / m;
    gradient << -c2 * F / (m * m), c2 / m, c1;
    hessian << 2 * c2 * F / (m * m * m), -c2 / (m * m), 0, -c2 / (m * m), 0, 0, 0, 0, 0;
  }
};

double largest_entry(const MatrixXd& x) { return x.cwiseAbs().maxCoeff(); }

Evaluator evaluator_of(const Problem& problem, GradientMethod method, const std::vector<std::string>& variables = {}) {
  EvaluatorOptions options;
  options.method = method;
  return Evaluator(problem.scene, objectives_of(problem), variables, options);
}

// Objectives of one parameter p alone, without a motion.
Problem of_p(double value, const std::string& expression) {
  Problem p;
  testing::add_parameters(p.scene, {{"p", value}});
  ObjectiveSpec only;
  only.name = "only", only.parameters_only = testing::f(expression);
  p.objectives = {only};
  return p;
}

ObjectiveHessian hessian_in_p(const Problem& problem) {
  Evaluator evaluator = evaluator_of(problem, GradientMethod::adjoint);
  const Hessians found = hessians(evaluator, evaluator.start());
  INFO(found.message);
  REQUIRE(found.ok);
  return found.of[0];
}

Problem five_bar_of_a_second(const std::string& integrator) {
  Problem problem = five_bar::problem(1e-7);
  problem.scene.simulation.end_time = 1;
  problem.scene.simulation.integrator.type = integrator;
  ObjectiveSpec drop;
  drop.name = "drop";
  drop.terminal = Expression::parse("r2_y");
  drop.parameters_only = Expression::parse("0.01*k1*m1");
  drop.samples = {{0.55, Expression::parse("r2_x*m2")}};
  problem.objectives.push_back(drop);
  return problem;
}

}  // namespace

TEST_CASE("Hessians of a free body's flight are those of its closed form", "[hessian]") {
  const std::string integrator = GENERATE(as<std::string>{}, "dopri5", "dopri853", "radau5");
  const GradientMethod method = GENERATE(GradientMethod::adjoint, GradientMethod::tlm);
  const Problem problem = free_body(integrator);
  Evaluator evaluator = evaluator_of(problem, method);
  const VectorXd rho = evaluator.start();
  const double m = rho(0), F = rho(1), v0 = rho(2), t = kEnd;

  const Rational x(t, t * t / 2, m, F, v0), integral(t * t / 2, t * t * t / 6, m, F, v0);
  Eigen::Matrix3d expected[3];
  expected[0] = x.hessian;
  expected[0](0, 0) += 2 * F, expected[0](0, 1) += 2 * m, expected[0](1, 0) += 2 * m, expected[0](2, 2) += std::exp(v0);
  expected[1] = 2 * (x.value * x.hessian + x.gradient * x.gradient.transpose());
  expected[2] = integral.hessian;  // and of the sample, m x(1) = m v0 + F/2
  expected[2](0, 2) += 1, expected[2](2, 0) += 1;

  const Hessians found = hessians(evaluator, rho);
  INFO(integrator << " by " << to_string(method) << " " << found.message);
  REQUIRE(found.ok);
  CHECK(found.method == method);
  CHECK(found.gradients <= 6 * 8);
  REQUIRE(found.of.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    const ObjectiveHessian& H = found.of[i];
    INFO("objective " << i << "\n" << H.value << "\nexpected\n" << expected[i] << "\nrelative error " << H.relative());
    CHECK(largest_entry(H.value - expected[i]) < 1e-8);
    CHECK(H.value == H.value.transpose());
    CHECK(H.relative() < 1e-8);
    CHECK(H.relative() > 0);
    CHECK(((H.value - expected[i]).array().abs() <= 10 * H.error.array() + 1e-13).all());
  }
}

TEST_CASE("five-bar: Hessians equal second differences of psi itself, and are symmetric to their error", "[hessian]") {
  const std::string integrator = GENERATE(as<std::string>{}, "dopri5", "radau5");
  const Problem problem = five_bar_of_a_second(integrator);
  const std::vector<std::string> variables{"L01", "k2", "c1", "m3"};
  Evaluator evaluator = evaluator_of(problem, GradientMethod::adjoint, variables);
  const VectorXd rho = evaluator.start();
  const Hessians found = hessians(evaluator, rho);
  INFO(integrator << " " << found.message);
  REQUIRE(found.ok);
  const StepSequence steps = evaluator.gradients(rho).steps;
  const Index n = static_cast<Index>(variables.size());
  VectorXd size(n);
  for (Index k = 0; k < n; ++k) {
    const auto index = static_cast<std::size_t>(evaluator.variables()[static_cast<std::size_t>(k)]);
    size(k) = typical_size(problem.scene.parameters[index], rho(static_cast<Index>(index)));
  }
  const auto psi_at = [&](Index p, double hp, Index q, double hq) {
    VectorXd shifted = rho;
    shifted(evaluator.variables()[static_cast<std::size_t>(p)]) += hp * size(p);
    shifted(evaluator.variables()[static_cast<std::size_t>(q)]) += hq * size(q);
    const Evaluation e = evaluator.values_on(steps, shifted);
    REQUIRE(e.ok);
    return e.psi;
  };
  // (psi(+,+) - psi(+,-) - psi(-,+) + psi(-,-))/(4 h^2), for p = q with the step 2 h; its error h^2 extrapolated away.
  const auto four_points = [&](Index p, Index q, double h) {
    const VectorXd sum = psi_at(p, h, q, h) - psi_at(p, h, q, -h) - psi_at(p, -h, q, h) + psi_at(p, -h, q, -h);
    return VectorXd(sum / (4 * h * h));
  };
  for (std::size_t i = 0; i < 2; ++i) {
    const ObjectiveHessian& H = found.of[i];
    INFO("objective " << i << ", relative error " << H.relative() << ", asymmetry " << H.asymmetry);
    CHECK(H.relative() < 1e-8);
    CHECK(H.asymmetry <= H.largest_error);
    CHECK(H.asymmetry > 0);
  }
  for (Index p = 0; p < n; ++p) {
    for (Index q = 0; q <= p; ++q) {
      const double h = 4e-3;
      const VectorXd expected = (4 * four_points(p, q, h / 2) - four_points(p, q, h)) / 3;
      for (Index i = 0; i < 2; ++i) {
        const ObjectiveHessian& H = found.of[static_cast<std::size_t>(i)];
        const double entry = H.value(p, q) * size(p) * size(q);
        INFO("objective " << i << " entry " << p << " " << q << ": " << entry << " against " << expected(i));
        CHECK(std::abs(entry - expected(i)) <= 1e-5 * std::max(std::abs(entry), 1e-2 * H.largest_entry));
      }
    }
  }
}

TEST_CASE("a Hessian times a vector is the product that is asked for alone", "[hessian]") {
  const std::string integrator = GENERATE(as<std::string>{}, "dopri5", "radau5");
  const Problem problem = five_bar_of_a_second(integrator);
  Evaluator evaluator = evaluator_of(problem, GradientMethod::adjoint, {"L02", "k1", "c2", "m1", "m2"});
  const VectorXd rho = evaluator.start();
  VectorXd d(5);
  d << 0.3, -20, 0.8, 0.5, -1.1;
  const Hessians full = hessians(evaluator, rho);
  const HessianProducts product = hessian_products(evaluator, rho, d);
  REQUIRE(full.ok);
  REQUIRE(product.ok);
  CHECK(product.gradients <= 16);
  for (Index i = 0; i < 2; ++i) {
    const MatrixXd& H = full.of[static_cast<std::size_t>(i)].value;
    const VectorXd expected = H * d, terms = H.cwiseAbs() * d.cwiseAbs();
    for (Index k = 0; k < d.size(); ++k) {
      INFO("objective " << i << " component " << k << ": " << product.product(i, k) << " +- " << product.error(i, k));
      CHECK(std::abs(product.product(i, k) - expected(k)) <= 1e-7 * terms(k));
    }
  }
  const HessianProducts none = hessian_products(evaluator, rho, VectorXd::Zero(5));
  CHECK(none.ok);
  CHECK(none.product == MatrixXd::Zero(2, 5));
  CHECK_THROWS_WITH(hessian_products(evaluator, rho, VectorXd::Zero(4)), Contains("4 components for 5 variables"));
}

TEST_CASE("Hessians stay within the bounds, and within what an expression is defined for", "[hessian]") {
  // p^3 + (p - 2)^12.5: not defined below 2, and there its second derivative is 12.
  Problem edge = of_p(2, "p^3 + (p - 2)^12.5");
  const ObjectiveHessian undefined_below = hessian_in_p(edge);
  CHECK(undefined_below.value(0, 0) == Approx(12).epsilon(1e-8));
  edge.scene.parameters[0].lower = 2;
  const ObjectiveHessian on_the_bound = hessian_in_p(edge);
  CHECK(on_the_bound.value(0, 0) == Approx(12).epsilon(1e-8));
  CHECK(std::abs(on_the_bound.value(0, 0) - 12) <= on_the_bound.error(0, 0));

  Problem above = of_p(2, "p^3 + (2 - p)^12.5");
  above.scene.parameters[0].upper = 2;
  CHECK(hessian_in_p(above).value(0, 0) == Approx(12).epsilon(1e-8));

  // The bound is nearer than the largest step, and beyond it nothing is defined.
  Problem near = of_p(2.001, "p^3 + (p - 2)^12.5");
  near.scene.parameters[0].lower = 2;
  CHECK(hessian_in_p(near).value(0, 0) == Approx(6 * 2.001).epsilon(1e-8));

  Evaluator nowhere = evaluator_of(of_p(2, "(p - 2)^2.5 + (2 - p)^2.5"), GradientMethod::adjoint);
  const Hessians found = hessians(nowhere, nowhere.start());
  CHECK_FALSE(found.ok);
  CHECK_THAT(found.message, Contains("'p'") && Contains("only"));
}

TEST_CASE("the error of a Hessian tells of kinks, of constants, and of values that are no measure of their effect",
          "[hessian]") {
  CHECK(hessian_in_p(of_p(0, "abs(p)")).relative() > 0.1);

  Evaluator linear = evaluator_of(of_p(3, "7*p"), GradientMethod::adjoint);
  const Hessians zero = hessians(linear, linear.start());
  REQUIRE(zero.ok);
  CHECK(zero.of[0].value(0, 0) == 0);
  CHECK(zero.of[0].relative() == 0);
  CHECK(zero.gradients == 4);  // two rungs say so, none is spent on wider steps

  // A small offset in something of size 1: steps of its own size see nothing but rounding.
  const double offset = 1e-9;
  const ObjectiveHessian small = hessian_in_p(of_p(offset, "sin(1 + p)"));
  CHECK(std::abs(small.value(0, 0) + std::sin(1 + offset)) <= small.error(0, 0));
  CHECK(small.value(0, 0) == Approx(-std::sin(1 + offset)).epsilon(1e-3));
}

TEST_CASE("there are no second derivatives on steps that cannot be frozen, nor of differences", "[hessian]") {
  Problem problem = free_body("cvodes_bdf");
  Evaluator by_cvodes = evaluator_of(problem, GradientMethod::adjoint);
  CHECK_THROWS_WITH(hessians(by_cvodes, by_cvodes.start()),
                    Contains("simulation.integrator.type: is cvodes_bdf") && Contains("cannot be frozen"));
  Evaluator differences = evaluator_of(free_body("dopri5"), GradientMethod::differences);
  CHECK_THROWS_WITH(hessians(differences, differences.start()), Contains("by fd: there are none"));
}

TEST_CASE("a Hessian whose base run fails, or that is abandoned, says so", "[hessian]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.integrator.max_steps = 3;
  Evaluator fails = evaluator_of(problem, GradientMethod::adjoint);
  const Hessians failed = hessians(fails, fails.start());
  CHECK_FALSE(failed.ok);
  CHECK_THAT(failed.message, Contains("more than 3 steps"));

  Evaluator works = evaluator_of(free_body("dopri5"), GradientMethod::adjoint);
  HessianOptions options;
  int calls = 0;
  options.progress = [&](int done, int of) {
    CHECK(of == 3);
    return ++calls == done && done < 2;
  };
  const Hessians abandoned = hessians(works, works.start(), options);
  CHECK_FALSE(abandoned.ok);
  CHECK(calls == 2);
}
