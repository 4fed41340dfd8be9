#include "optim/tradeoff/pareto.hpp"

#include <catch2/catch.hpp>
#include <limits>
#include <random>

using namespace mbsopt;

TEST_CASE("the Pareto front holds what nothing else beats in both", "[pareto]") {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> cost(200), error(200);
  for (std::size_t i = 0; i < cost.size(); ++i) cost[i] = uniform(generator), error[i] = uniform(generator);
  const std::vector<bool> front = pareto_front(cost, error);
  int on_front = 0;
  for (std::size_t i = 0; i < cost.size(); ++i) {
    bool beaten = false;
    for (std::size_t j = 0; j < cost.size(); ++j)
      beaten = beaten || (j != i && cost[j] <= cost[i] && error[j] <= error[i]);
    CHECK(front[i] != beaten);
    on_front += front[i];
  }
  CHECK(on_front > 1);
}

TEST_CASE("of equals the first is on the Pareto front, what is not finite never", "[pareto]") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  CHECK(pareto_front({1, 1, nan, 0.5, 2}, {1, 1, 0, nan, inf}) == std::vector<bool>{true, false, false, false, false});
  CHECK(pareto_front({}, {}).empty());
}
