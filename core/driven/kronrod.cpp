#include "core/driven/kronrod.hpp"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>

namespace mbsopt {

const KronrodRule& kronrod_rule() {
  static const KronrodRule rule = [] {
    using Kronrod = boost::math::quadrature::gauss_kronrod<double, kNodes>;
    using Gauss = boost::math::quadrature::gauss<double, kNodes / 2>;
    // Both tables list the nodes in [0, 1) of the interval [-1, 1]. Every second node belongs to both.
    constexpr std::size_t middle = kNodes / 2;
    KronrodRule r{};
    for (std::size_t k = 0; k <= middle; ++k) {
      const double x = Kronrod::abscissa()[k] / 2, w = Kronrod::weights()[k] / 2;
      const double g = k % 2 == 0 ? Gauss::weights()[k / 2] / 2 : 0.0;
      r.nodes[middle - k] = 0.5 - x;
      r.nodes[middle + k] = 0.5 + x;
      r.kronrod[middle - k] = r.kronrod[middle + k] = w;
      r.gauss[middle - k] = r.gauss[middle + k] = g;
    }
    return r;
  }();
  return rule;
}

// QUADPACK, section 2.2.4.1: with D the integral of |g - mean|, error = D min(1, (200 |K - G|/D)^1.5).
PanelIntegral integrate_panel(std::span<const double> g, double h) {
  const KronrodRule& rule = kronrod_rule();
  double K = 0, G = 0, absolute = 0, deviation = 0;
  for (std::size_t k = 0; k < kNodes; ++k) {
    K += rule.kronrod[k] * g[k];
    G += rule.gauss[k] * g[k];
    absolute += rule.kronrod[k] * std::abs(g[k]);
  }
  for (std::size_t k = 0; k < kNodes; ++k) deviation += rule.kronrod[k] * std::abs(g[k] - K);
  const double difference = std::abs(K - G);
  const double error = deviation > 0 ? deviation * std::min(1.0, std::pow(200 * difference / deviation, 1.5)) : 0;
  return {h * K, h * absolute, h * error};
}

}  // namespace mbsopt
