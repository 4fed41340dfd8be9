#include "core/driven/kronrod.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

using namespace mbsopt;

namespace {

PanelIntegral over_unit_interval(double (*g)(double)) {
  std::vector<double> values;
  for (const double x : kronrod_rule().nodes) values.push_back(g(x));
  return integrate_panel(values, 1);
}

}  // namespace

TEST_CASE("Kronrod's formula is exact to degree 22, Gauss' to degree 13, and no further", "[kronrod]") {
  const KronrodRule& rule = kronrod_rule();
  const auto moment = [&](const std::array<double, kNodes>& weights, int degree) {
    double sum = 0;
    for (std::size_t k = 0; k < kNodes; ++k) sum += weights[k] * std::pow(2 * rule.nodes[k] - 1, degree);
    return sum;
  };
  for (int degree = 0; degree <= 22; degree += 2)
    CHECK(moment(rule.kronrod, degree) == Approx(1.0 / (degree + 1)).epsilon(1e-13));
  for (int degree = 0; degree <= 12; degree += 2)
    CHECK(moment(rule.gauss, degree) == Approx(1.0 / (degree + 1)).epsilon(1e-13));
  CHECK(std::abs(moment(rule.gauss, 14) - 1.0 / 15) > 1e-6);
  CHECK(std::abs(moment(rule.kronrod, 24) - 1.0 / 25) > 1e-12);
}

TEST_CASE("the estimated error of a panel is above its error, and small where the integrand is smooth", "[kronrod]") {
  const PanelIntegral smooth = over_unit_interval([](double x) { return std::exp(x); });
  CHECK(smooth.value == Approx(std::exp(1.0) - 1).epsilon(1e-14));
  CHECK(smooth.error < 1e-14);
  const PanelIntegral kink = over_unit_interval([](double x) { return std::abs(x - 0.3); });
  CHECK(std::abs(kink.value - (0.3 * 0.3 + 0.7 * 0.7) / 2) < kink.error);
}
