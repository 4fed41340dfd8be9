#include "core/run/differentiated_cost.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;
using Eigen::VectorXd;

namespace {

struct Effort final : DifferentiatedRunningCost<Effort> {
  template <class T>
  T integrand(double t, const VectorX<T>& y, const VectorX<T>& rho) const {
    return t * rho(1) * sin(y(20)) * y(3) + rho(0) * rho(0);
  }
};

struct Miss final : DifferentiatedTerminalCost<Miss> {
  template <class T>
  T at_end(const VectorX<T>& y, const VectorX<T>& rho) const {
    return (y(0) - 1.) * (y(0) - 1.) * exp(rho(2));
  }
};

}  // namespace

TEST_CASE("costs written once have the gradients of calculus", "[cost]") {
  const VectorXd y = VectorXd::Random(28), rho = VectorXd::Random(3);
  const double t = 0.7, scale = 1.5;
  const Effort effort;
  CHECK(effort.g(t, y, rho) == Approx(t * rho(1) * std::sin(y(20)) * y(3) + rho(0) * rho(0)).epsilon(1e-15));
  VectorXd g_y = VectorXd::Ones(28), g_rho = VectorXd::Ones(3);  // what was there stays
  effort.add_g_y(t, y, rho, scale, g_y);
  effort.add_g_rho(t, y, rho, scale, g_rho);
  VectorXd expected_y = VectorXd::Ones(28);
  expected_y(20) += scale * t * rho(1) * std::cos(y(20)) * y(3);
  expected_y(3) += scale * t * rho(1) * std::sin(y(20));
  CHECK((g_y - expected_y).norm() < 1e-15);
  CHECK((g_rho - VectorXd::Ones(3) - scale * Eigen::Vector3d(2 * rho(0), t * std::sin(y(20)) * y(3), 0)).norm() <
        1e-15);

  const Miss miss;
  VectorXd lambda = VectorXd::Ones(28), mu = VectorXd::Ones(3);
  miss.adjoint_init(y, rho, lambda, mu);
  const double d = y(0) - 1, e = std::exp(rho(2));
  CHECK(miss.value(y, rho) == Approx(d * d * e).epsilon(1e-15));
  CHECK((lambda - VectorXd(2 * d * e * VectorXd::Unit(28, 0))).norm() < 1e-15);
  CHECK((mu - Eigen::Vector3d(0, 0, d * d * e)).norm() < 1e-15);
}
