#include "optim/objective/one_to_one.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <numeric>
#include <random>

using namespace mbsopt;
using Eigen::Index;

namespace {

double best_of_all_orders(const Eigen::MatrixXd& gain) {
  std::vector<Index> order(static_cast<std::size_t>(gain.cols()));
  std::iota(order.begin(), order.end(), Index{0});
  double best = -1e9;
  do {
    double sum = 0;
    for (Index i = 0; i < gain.rows(); ++i) sum += gain(i, order[static_cast<std::size_t>(i)]);
    best = std::max(best, sum);
  } while (std::ranges::next_permutation(order).found);
  return best;
}

}  // namespace

TEST_CASE("an assignment gives every row a column of its own, with the largest sum of all orders", "[one_to_one]") {
  std::mt19937 random(GENERATE(1, 2, 3, 4, 5));
  std::uniform_real_distribution<double> number(-1, 1);
  const Index rows = GENERATE(1, 3, 5), more = GENERATE(0, 2);
  Eigen::MatrixXd gain(rows, rows + more);
  for (double& g : gain.reshaped()) g = number(random);
  if (more > 0) gain.col(0) = gain.col(1);  // equal gains
  const std::vector<Index> columns = one_to_one(gain), of_transposed = one_to_one(gain.transpose());
  double sum = 0;
  std::vector<bool> is_taken(static_cast<std::size_t>(gain.cols()), false);
  for (Index i = 0; i < rows; ++i) {
    const std::size_t j = static_cast<std::size_t>(columns[static_cast<std::size_t>(i)]);
    CHECK_FALSE(is_taken.at(j));
    is_taken[j] = true;
    sum += gain(i, static_cast<Index>(j));
  }
  CHECK(sum == Approx(best_of_all_orders(gain)).margin(1e-14));
  CHECK(std::ranges::count(of_transposed, Index{-1}) == more);
}
