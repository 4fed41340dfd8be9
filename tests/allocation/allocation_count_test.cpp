#include "tests/allocation/allocation_count.hpp"

#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <memory>
#include <vector>

TEST_CASE("each kind of allocation that a step could make is counted", "[allocation]") {
  const long before = allocation_count();
  const auto number = std::make_unique<double>(1.0);
  const long after_new = allocation_count();
  const std::vector<double> values(100, *number);
  const long after_vector = allocation_count();
  const Eigen::VectorXd vector = Eigen::VectorXd::Constant(100, values[0]);
  const long after_eigen = allocation_count();
  const Eigen::Matrix<double, 6, 6> fixed = Eigen::Matrix<double, 6, 6>::Constant(vector(0));
  const long after_fixed = allocation_count();
  CHECK(after_new == before + 1);
  CHECK(after_vector == after_new + 1);
  CHECK(after_eigen == after_vector + 1);
  CHECK(after_fixed == after_eigen);
  CHECK(fixed.sum() == 36);
}
