#include "optim/tradeoff/tradeoff.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

using namespace mbsopt;

namespace {

TradeoffRow row_of(const std::string& curve, long work, std::vector<double> errors, RowStatus status = RowStatus::ok) {
  TradeoffRow row;
  row.setting.curve = curve;
  row.status = status;
  row.statistics.rhs_evaluations = work;
  row.errors = Eigen::Map<Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
  return row;
}

std::vector<double> bounds_of(const std::vector<TradeoffRow>& rows, Eigen::Index q) {
  std::vector<double> bounds;
  for (const TradeoffRow& row : rows) bounds.push_back(row.bounds(q));
  return bounds;
}

std::vector<Quantity> quantities(bool relative) {
  return {Quantity{QuantityKind::objective, "travel", "travel", 0, relative, 1, 0}};
}

}  // namespace

TEST_CASE("a bound is the largest error from a setting on, so that none is small by chance", "[tradeoff]") {
  // Curves are measured side by side; the error of `a` passes through zero at its second setting.
  std::vector<TradeoffRow> rows{row_of("a", 10, {1e-1}), row_of("b", 10, {1e-9}), row_of("a", 20, {1e-8}),
                                row_of("b", 20, {1e-3}), row_of("a", 30, {1e-4}), row_of("b", 30, {1e-5}),
                                row_of("a", 40, {1e-6})};
  bound_errors(rows);
  CHECK(bounds_of(rows, 0) == std::vector<double>{1e-1, 1e-3, 1e-4, 1e-3, 1e-4, 1e-5, 1e-6});
}

TEST_CASE("a setting that failed and an error that is not known have no bound and raise none", "[tradeoff]") {
  const double inf = std::numeric_limits<double>::infinity();
  std::vector<TradeoffRow> rows{row_of("a", 10, {1e-2, kNaN}), row_of("a", 20, {inf, 5}, RowStatus::failed),
                                row_of("a", 30, {1e-3, 0.5}), row_of("a", 40, {kNaN, 0.25}),
                                row_of("a", 50, {kNaN, kNaN}, RowStatus::skipped)};
  bound_errors(rows);
  for (const std::size_t i : {1u, 3u, 4u}) CHECK(std::isnan(rows[i].bounds(0)));
  for (const std::size_t i : {0u, 1u, 4u}) CHECK(std::isnan(rows[i].bounds(1)));
  CHECK(rows[0].bounds(0) == 1e-2);
  CHECK(rows[2].bounds(0) == 1e-3);
  CHECK(rows[2].bounds(1) == 0.5);
  CHECK(rows[3].bounds(1) == 0.25);
}

TEST_CASE("settings that stand alone have their own errors as bounds and are no curve", "[tradeoff]") {
  std::vector<TradeoffRow> rows{row_of("as in the file", 90, {1e-6, kNaN}), row_of("defaults", 80, {1e-7, kNaN}),
                                row_of("as in the file", 90, {kNaN, 1e-2}), row_of("a", 10, {1e-2, kNaN})};
  bound_errors(rows);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (Eigen::Index q = 0; q < 2; ++q)
      CHECK(
          (rows[i].bounds(q) == rows[i].errors(q) || (std::isnan(rows[i].bounds(q)) && std::isnan(rows[i].errors(q)))));
  const std::vector<WorkPrecisionCurve> curves = work_precision_curves(rows, quantities(true), 0);
  REQUIRE(curves.size() == 1);
  CHECK(curves[0].name == "a");
}

TEST_CASE("a work-precision line leaves out what a tighter setting dominates and what is no better than zero",
          "[tradeoff]") {
  // The third setting is at the edge of stability: its steps are rejected more often than those of the fourth.
  std::vector<TradeoffRow> rows{row_of("a", 5, {0.3}),    row_of("a", 10, {2}),    row_of("a", 50, {1e-2}),
                                row_of("a", 40, {1e-3}),  row_of("a", 60, {1e-9}), row_of("a", 60, {1e-4}),
                                row_of("a", 200, {1e-6}), row_of("b", 1, {7})};
  bound_errors(rows);
  const std::vector<WorkPrecisionCurve> relative = work_precision_curves(rows, quantities(true), 0);
  REQUIRE(relative.size() == 1);  // of `b` nothing is left
  CHECK(relative[0].line == std::vector<std::size_t>{3, 5, 6});
  // Of a line a plot over time connects what no tighter setting was as fast as; the line itself is no matter of time.
  rows[3].wall_seconds = 0.2, rows[5].wall_seconds = 0.1, rows[6].wall_seconds = 0.3;
  CHECK(slower_and_slower(rows, relative[0].line) == std::vector<std::size_t>{5, 6});
  CHECK(work_precision_curves(rows, quantities(true), 0)[0].line == relative[0].line);
  // How large an absolute error may be nobody knows.
  const std::vector<WorkPrecisionCurve> absolute = work_precision_curves(rows, quantities(false), 0);
  REQUIRE(absolute.size() == 2);
  CHECK(absolute[0].line == std::vector<std::size_t>{0, 1, 3, 5, 6});
  CHECK(absolute[1].line == std::vector<std::size_t>{7});
}

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
