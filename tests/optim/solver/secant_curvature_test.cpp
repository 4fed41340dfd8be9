#include "optim/solver/secant_curvature.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using mbsopt::testing::vector;

TEST_CASE("secant curvature: a quadratic's Hessian from conjugate steps", "[secant_curvature]") {
  Eigen::Matrix2d H;
  H << 5, 1, 1, 3;
  SecantCurvature curvature(1);
  Eigen::Vector2d x(1, 2);
  curvature.add(x, H * x);
  CHECK(curvature.matrix() == Eigen::Matrix2d::Identity());
  for (const Eigen::Vector2d& s : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-0.2, 1)}) {  // s1' H s2 = 0
    x += s;
    curvature.add(x, H * x);
    CHECK((curvature.matrix() * s - H * s).norm() < 1e-13);
  }
  CHECK((curvature.matrix() - H).norm() < 1e-13);
  curvature.add(x, H * x);
  CHECK((curvature.matrix() - H).norm() < 1e-13);
}

TEST_CASE("secant curvature: positive definite whatever the gradients do", "[secant_curvature]") {
  SecantCurvature curvature(2);
  curvature.add(vector({0, 0}), vector({0, 0}));
  curvature.add(vector({1, 0}), vector({-1, 0}));  // curves down
  CHECK(curvature.matrix() == 2 * Eigen::Matrix2d::Identity());
  curvature.add(vector({1, 1}), vector({-1, 7}));
  CHECK(Eigen::LLT<Eigen::MatrixXd>(curvature.matrix()).info() == Eigen::Success);
  CHECK(curvature.matrix()(1, 1) == Approx(7));
}

TEST_CASE("secant curvature: old iterates are forgotten", "[secant_curvature]") {
  SecantCurvature curvature(1, 1);
  curvature.add(vector({0, 0}), vector({0, 0}));
  curvature.add(vector({1, 0}), vector({4, 0}));
  CHECK(curvature.matrix()(0, 0) == Approx(4));
  curvature.add(vector({1, 1}), vector({4, 9}));
  CHECK(curvature.matrix()(0, 0) == Approx(1));
  CHECK(curvature.matrix()(1, 1) == Approx(9));
}

TEST_CASE("curvature that a matrix leaves out is learnt from the gradients, and only where it contradicts them",
          "[secant_curvature]") {
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 3, 1, 1, 5).finished();
  SecantCurvature curvature(1);
  const Eigen::Matrix2d half = H / 4;
  curvature.add(Eigen::Vector2d(0, 0), Eigen::Vector2d(0, 0));
  CHECK_FALSE(curvature.contradicts(half));  // nothing is known yet
  for (const Eigen::Vector2d& x : {Eigen::Vector2d(1, 0), Eigen::Vector2d(1, 2), Eigen::Vector2d(-1, 1)})
    curvature.add(x, H * x);
  CHECK_FALSE(curvature.contradicts(H));
  CHECK_FALSE(curvature.contradicts(0.7 * H));
  CHECK(curvature.contradicts(half));
  CHECK(curvature.contradicts(2 * H));
  CHECK((curvature.matrix_from(H) - H).norm() < 1e-12);
  const Eigen::Vector2d last(-2, -1);
  CHECK((curvature.matrix_from(half) * last - H * last).norm() < 1e-12);
  CHECK((curvature.matrix_from(half) - H).norm() < (half - H).norm());
}
