#include "optim/solver/third_order_step.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using mbsopt::testing::vector;

namespace {

// Minimum at 0, convex, with third derivatives along and across.
struct Exponentials : NonlinearProgram {
  Exponentials() : NonlinearProgram(2, 0) {}
  static Eigen::Vector2d gradient(const Eigen::VectorXd& x) {
    const double a = std::exp(x(0) + x(1)) - 1, b = std::exp(x(0) - 2 * x(1)) - 1;
    return {a + b, a - 2 * b};
  }
  static Eigen::Matrix2d hessian(const Eigen::VectorXd& x) {
    const double a = std::exp(x(0) + x(1)), b = std::exp(x(0) - 2 * x(1));
    return (Eigen::Matrix2d() << a + b, a - 2 * b, a - 2 * b, a + 4 * b).finished();
  }
  void evaluate(const Eigen::VectorXd& x, NlpPoint& p) override {
    p.f = std::exp(x(0) + x(1)) + std::exp(x(0) - 2 * x(1)) - 2 * x(0) + x(1);
    p.f_x = gradient(x);
  }
};

Eigen::VectorXd third_along(const Eigen::VectorXd& x, const Eigen::VectorXd& d) {
  return 2 * (Exponentials::gradient(x + d) - Exponentials::gradient(x) - Exponentials::hessian(x) * d);
}

// Of the error, from the last three.
double order(const std::vector<double>& e) { return std::log(e[2] / e[1]) / std::log(e[1] / e[0]); }

}  // namespace

TEST_CASE("third-order steps converge cubically, where Newton's do quadratically", "[third_order_step]") {
  const Exponentials problem;
  const auto errors = [&](bool third) {
    std::vector<double> e;
    Eigen::VectorXd x = vector({0.1, 0.06});
    for (int k = 0; k < 3; ++k) {
      e.push_back(x.norm());
      const Eigen::VectorXd f_x = Exponentials::gradient(x);
      const Eigen::MatrixXd H = Exponentials::hessian(x);
      const auto d = newton_step(problem, x, f_x, H);
      REQUIRE(d.has_value());
      const auto B = third_order_hessian(H, *d, third_along(x, *d));
      REQUIRE(B.has_value());
      x -= Eigen::LLT<Eigen::MatrixXd>(third ? *B : H).solve(f_x);
    }
    return e;
  };
  CHECK(order(errors(false)) == Approx(2).margin(0.3));
  CHECK(order(errors(true)) == Approx(3).margin(0.3));
}

TEST_CASE("a third-order step solves its model, by a positive definite matrix", "[third_order_step]") {
  const Eigen::Matrix3d H = (Eigen::Matrix3d() << 4, 1, 0, 1, 3, -1, 0, -1, 2).finished();
  const Eigen::Vector3d f_x(0.3, -0.5, 0.2);
  const Eigen::VectorXd d = -H.llt().solve(f_x);
  const double dHd = d.dot(H * d);
  const double along = GENERATE(-0.4, 0.7, 30.0), across = GENERATE(0.0, 0.2);
  INFO("along " << along << ", across " << across);
  Eigen::VectorXd w = vector({1, 2, -1});
  w -= w.dot(H * d) / dHd * d;
  const Eigen::VectorXd t = H * (along * d + across * std::sqrt(dHd / w.dot(H * w)) * w);
  const auto B = third_order_hessian(H, d, t);
  REQUIRE(B.has_value());
  CHECK((*B - B->transpose()).norm() < 1e-14);
  const Eigen::LLT<Eigen::MatrixXd> factor(*B);
  REQUIRE(factor.info() == Eigen::Success);
  const Eigen::VectorXd s = -factor.solve(f_x);
  const double beta = s.dot(H * d) / dHd;
  CHECK((f_x + H * s + beta * beta / 2 * t).norm() < 1e-13);
  CHECK(beta > 0);
}

TEST_CASE("where the model's slope has no zero the step is twice Newton's, or there is none", "[third_order_step]") {
  const Eigen::MatrixXd H = Eigen::MatrixXd::Constant(1, 1, 2.0);
  const Eigen::VectorXd d = vector({0.5});  // f_x = -1
  const auto step = [&](double tau) {
    const auto B = third_order_hessian(H, d, tau * (H * d));
    return B ? 1 / (*B)(0, 0) : 0.0;
  };
  CHECK(step(0) == Approx(0.5));
  CHECK(step(-0.5) == Approx(1.0));
  CHECK(step(-0.8) == Approx(1.0));
  CHECK(step(-1.1) == 0.0);
  CHECK(step(1.5) == Approx(0.5 * 2 / 3));
}

TEST_CASE("a third derivative that would turn the step aside is left out", "[third_order_step]") {
  const Eigen::Matrix2d H = Eigen::Matrix2d::Identity();
  const Eigen::VectorXd d = vector({1, 1}), across = vector({1, -1});
  CHECK(third_order_hessian(H, d, 1.9 * across).has_value());
  CHECK_FALSE(third_order_hessian(H, d, 2.1 * across).has_value());
  CHECK_FALSE(third_order_hessian(H, d, std::nan("") * across).has_value());
}

TEST_CASE("Newton's step holds variables at their bounds, and is none where it would cross one", "[third_order_step]") {
  Exponentials problem;
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 2, 1, 1, 3).finished();
  const Eigen::VectorXd x = vector({0.5, 0.5});
  problem.x_lower << 0.5, 0, problem.x_upper << 1, 1;
  const auto held = newton_step(problem, x, vector({1, -0.6}), H);
  REQUIRE(held.has_value());
  CHECK((*held)(0) == 0);
  CHECK((*held)(1) == Approx(0.2));
  const auto inward = newton_step(problem, x, vector({-0.1, 0.2}), H);
  REQUIRE(inward.has_value());
  CHECK((H * *inward - vector({0.1, -0.2})).norm() < 1e-15);
  CHECK_FALSE(newton_step(problem, x, vector({1, 3}), H).has_value());  // to -0.5
  CHECK_FALSE(newton_step(problem, x, vector({-0.1, 0.2}), -H).has_value());
  problem.x_lower(1) = 0.5;
  CHECK_FALSE(newton_step(problem, x, vector({1, 1}), H).has_value());  // all are held
}
