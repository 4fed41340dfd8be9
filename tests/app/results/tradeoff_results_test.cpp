#include "app/results/tradeoff_results.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "tests/optim/counted_clock.hpp"
#include "tests/optim/pendulum.hpp"

using namespace mbsopt;

namespace {

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line);
  for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
  return cells;
}

}  // namespace

TEST_CASE("tradeoff.csv has errors as they are and bounds beside them", "[tradeoff]") {
  Problem p = pendulum::problem(100, 0.1, 0.1, 0);
  p.scene.simulation.end_time = 0.2;
  CountedClock clock;
  TradeoffOptions options;
  options.budget_seconds = 0, options.clock = clock.clock();
  Tradeoff tradeoff = measure_tradeoff(p.scene, objectives_of(p), options);
  REQUIRE(tradeoff.ok());
  tradeoff.rows.clear();
  const auto quantities = static_cast<Eigen::Index>(tradeoff.quantities().size());
  for (const double error : {1e-6, std::nan(""), 1e-3}) {
    TradeoffRow& row = tradeoff.rows.emplace_back();
    row.setting.curve = "dopri5";
    if (std::isnan(error)) row.status = RowStatus::failed;
    row.errors.setConstant(quantities, error), row.deviations = row.errors;
  }
  bound_errors(tradeoff.rows);
  std::istringstream text(to_csv(tradeoff));
  std::string line;
  REQUIRE(std::getline(text, line));
  const std::vector<std::string> header = cells_of(line);
  const auto column = [&](const char* name) {
    const auto found = std::find(header.begin(), header.end(), name);
    REQUIRE(found != header.end());
    return static_cast<std::size_t>(std::distance(header.begin(), found));
  };
  for (const auto& [error, bound] : {std::pair{"1e-06", "0.001"}, {"", ""}, {"0.001", "0.001"}}) {
    REQUIRE(std::getline(text, line));
    const std::vector<std::string> cells = cells_of(line);
    CHECK(cells.at(column("error motion")) == error);
    CHECK(cells.at(column("bound motion")) == bound);
  }
}
