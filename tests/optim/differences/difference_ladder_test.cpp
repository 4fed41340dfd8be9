#include "optim/differences/difference_ladder.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace mbsopt;

TEST_CASE("the ladder's derivative is right within its own error estimate", "[differences]") {
  const double x = 0.7;
  const auto f = [&](double h) {
    return std::optional<Eigen::VectorXd>(Eigen::Vector3d(std::exp(x + h), std::sin(40 * (x + h)), 1e6 + (x + h)));
  };
  const LadderDerivative d = difference_ladder(f, 3, {1e-2, 8, 0});
  const double exact[] = {std::exp(x), 40 * std::cos(40 * x), 1};
  for (int i = 0; i < 3; ++i) {
    INFO("component " << i);
    CHECK(std::abs(d.derivative(i) - exact[i]) <= 4 * d.error(i));
    CHECK(d.error(i) >= d.rounding(i));
  }
  CHECK(std::abs(d.derivative(0) / exact[0] - 1) < 1e-12);
  CHECK(std::abs(d.derivative(1) / exact[1] - 1) < 1e-9);
  CHECK(d.error(2) < 1e-6);  // its values carry 16 digits of 1e6
  CHECK(d.evaluations == 16);
}

TEST_CASE("steps that cannot be evaluated are skipped", "[differences]") {
  const auto f = [](double h) -> std::optional<Eigen::VectorXd> {
    if (h < -2e-3) return std::nullopt;
    return Eigen::VectorXd::Constant(1, std::sqrt(2e-3 + h));
  };
  const LadderDerivative d = difference_ladder(f, 1, {1e-2, 12, 0});
  CHECK(d.derivative(0) == Approx(0.5 / std::sqrt(2e-3)).epsilon(1e-8));
  const auto never = [](double) -> std::optional<Eigen::VectorXd> { return std::nullopt; };
  CHECK(std::isinf(difference_ladder(never, 1, {1e-2, 4, 0}).error(0)));
}

TEST_CASE("the one-sided ladder looks at one side only, and its error covers its own", "[differences]") {
  const double x = 0.7;
  for (const double step : {1e-2, -1e-2}) {
    const auto f = [&](double h) -> std::optional<Eigen::VectorXd> {
      CHECK(h * step > 0);
      return Eigen::Vector2d(std::exp(x + h), std::sin(5 * (x + h)));
    };
    const Eigen::Vector2d f0(std::exp(x), std::sin(5 * x)), exact(std::exp(x), 5 * std::cos(5 * x));
    const LadderDerivative d = one_sided_ladder(f, f0, {step, 8, 0});
    for (int i = 0; i < 2; ++i) {
      INFO("step " << step << " component " << i);
      CHECK(std::abs(d.derivative(i) - exact(i)) <= 4 * d.error(i));
      CHECK(std::abs(d.derivative(i) / exact(i) - 1) < 1e-9);
      CHECK(d.step(i) > 0);
    }
    CHECK(d.evaluations == 8);
  }
}

TEST_CASE("a ladder ends where its derivative is good enough", "[differences]") {
  const auto f = [](double h) { return std::optional<Eigen::VectorXd>(Eigen::VectorXd::Constant(1, std::exp(h))); };
  const auto enough = [](const LadderDerivative& best) { return best.error(0) < 1e-6; };
  const LadderDerivative d = difference_ladder(f, 1, {1e-1, 12, 0, enough});
  CHECK(d.error(0) < 1e-6);
  CHECK(std::abs(d.derivative(0) - 1) <= d.error(0));
  CHECK(d.evaluations < 12);
}
