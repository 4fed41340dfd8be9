// The Pareto front of cost and error: settings that no other beats in both.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace mbsopt {

// Returns whether each setting is on the front. A setting with infinite cost or error never is; the first of
// equals is.
inline std::vector<bool> pareto_front(const std::vector<double>& cost, const std::vector<double>& error) {
  const auto known = [&](std::size_t i) { return std::isfinite(cost[i]) && std::isfinite(error[i]); };
  std::vector<std::size_t> order(cost.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    if (known(a) != known(b)) return known(a);
    if (!known(a)) return false;
    return cost[a] < cost[b] || (cost[a] == cost[b] && error[a] < error[b]);
  });
  std::vector<bool> front(cost.size(), false);
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (!known(i) || !(error[i] < least)) continue;
    least = error[i];
    front[i] = true;
  }
  return front;
}

}  // namespace mbsopt
