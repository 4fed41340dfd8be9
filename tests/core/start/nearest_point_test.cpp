#include "core/start/nearest_point.hpp"

#include <catch2/catch.hpp>
#include <functional>

using namespace mbsopt;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Equations : NearestPointEquations {
  std::function<VectorXd(const VectorXd&)> F;
  std::function<MatrixXd(const VectorXd&)> F_x;
  std::function<MatrixXd(const VectorXd&, const VectorXd&)> nu_F_xx;

  VectorXd values(const VectorXd& x) const override { return F(x); }
  MatrixXd jacobian(const VectorXd& x) const override { return F_x(x); }
  MatrixXd curvature(const VectorXd& x, const VectorXd& nu) const override { return nu_F_xx(x, nu); }
  double step_fraction(const VectorXd& step) const override {
    const double size = step.lpNorm<Eigen::Infinity>();
    return size > 0.3 ? 0.3 / size : 1;
  }
  VectorXd retracted(const VectorXd& x) const override { return x; }
  VectorXd weights() const override { return VectorXd::Ones(F(VectorXd::Ones(2)).size()); }
};

// x^2 + (a y)^2 = 1, its multiples by 1 to `copies`.
Equations ellipse(double a, int copies = 1) {
  Equations e;
  e.F_x = [=](const VectorXd& x) {
    MatrixXd J(copies, 2);
    for (int i = 0; i < copies; ++i) J.row(i) << 2 * (i + 1) * x(0), 2 * (i + 1) * a * a * x(1);
    return J;
  };
  e.F = [=](const VectorXd& x) {
    VectorXd f(copies);
    for (int i = 0; i < copies; ++i) f(i) = (i + 1) * (x(0) * x(0) + a * a * x(1) * x(1) - 1);
    return f;
  };
  e.nu_F_xx = [=](const VectorXd&, const VectorXd& nu) {
    double sum = 0;
    for (int i = 0; i < copies; ++i) sum += (i + 1) * nu(i);
    return MatrixXd(sum * Eigen::Vector2d(2, 2 * a * a).asDiagonal());
  };
  return e;
}

VectorXd point(double x, double y) { return Eigen::Vector2d(x, y); }

}  // namespace

TEST_CASE("the nearest point of a circle lies on the ray through the guess, from inside and far outside",
          "[assembly]") {
  const double size = GENERATE(0.05, 0.4, 1.0, 1.7, 4.0, 20.0);
  const int copies = GENERATE(1, 3);  // redundant equations change nothing
  Equations circle = ellipse(1, copies);
  NearestPoint found = nearest_point(circle, size * point(0.6, 0.8));
  REQUIRE(found.status == NearestPointStatus::found);
  CHECK((found.x - point(0.6, 0.8)).norm() < 1e-15);
  linearise(circle, found);
  CHECK(found.linearisation.rank() == 1);
}

TEST_CASE("the nearest point moves as the closed form says, forward and backward", "[assembly]") {
  // Circle of radius R: x = R g/|g|. With b = -F_R R' = 2 R R' and g = x_guess':
  Equations circle = ellipse(1);
  const VectorXd guess = 3 * point(0.6, 0.8);
  const NearestPoint found = nearest_point(circle, guess);
  const VectorXd tangent = point(-0.8, 0.6);
  const MatrixXd b = MatrixXd::Constant(1, 1, 2.0);
  CHECK((found.linearisation.solve(b, VectorXd::Zero(2)) - point(0.6, 0.8)).norm() < 1e-14);
  CHECK((found.linearisation.solve(MatrixXd::Zero(1, 1), tangent) - tangent / 3).norm() < 1e-14);
  const MatrixXd x_bar = (MatrixXd(2, 3) << 1, 0, 0.3, 0, 1, -2).finished();
  MatrixXd b_bar, g_bar;
  found.linearisation.solve_transposed(x_bar, b_bar, g_bar);
  const VectorXd g = point(0.7, -1.1);
  CHECK((b_bar.transpose() * b + g_bar.transpose() * g - x_bar.transpose() * found.linearisation.solve(b, g)).norm() <
        1e-14);
}

TEST_CASE("a guess at the centre of a circle is not decided by rounding", "[assembly]") {
  Equations circle = ellipse(1);
  CHECK(nearest_point(circle, point(0, 0)).status != NearestPointStatus::found);
}

TEST_CASE("a guess on the long axis of an ellipse, where the nearest point ceases to be unique, is refused",
          "[assembly]") {
  // Semi-axes 1 and 1/2; inside the evolute, at (0.1, 0), the vertex (1, 0) is no minimum: two points above and below
  // are nearer, and from the axis itself none is preferred.
  Equations e = ellipse(2);
  const NearestPoint found = nearest_point(e, point(0.8, 0));
  REQUIRE(found.status == NearestPointStatus::found);
  CHECK((found.x - point(1, 0)).norm() < 1e-15);
  CHECK(nearest_point(e, point(0.1, 1e-9)).status == NearestPointStatus::found);
  CHECK(std::abs(nearest_point(e, point(0.1, 1e-9)).x(1)) > 0.4);
}

TEST_CASE("equations without a solution end at their least violation", "[assembly]") {
  // On the unit circle and at x = 3: least sum of squares on the x axis, 4 x (x^2 - 1)/2 + (x - 3) = 0.
  Equations e = ellipse(1);
  Equations both;
  both.F = [=](const VectorXd& x) { return VectorXd(Eigen::Vector2d(e.F(x)(0), x(0) - 3)); };
  both.F_x = [=](const VectorXd& x) {
    MatrixXd J(2, 2);
    J << e.F_x(x), 1, 0;
    return J;
  };
  both.nu_F_xx = [=](const VectorXd& x, const VectorXd& nu) { return e.nu_F_xx(x, nu.head(1)); };
  const NearestPoint found = nearest_point(both, point(0.5, 0.6));
  REQUIRE(found.status == NearestPointStatus::unsatisfiable);
  CHECK(std::abs(found.x(1)) < 1e-3);
  CHECK(2 * found.x(0) * (found.x(0) * found.x(0) - 1) + found.x(0) - 3 == Approx(0).margin(1e-5));
}
