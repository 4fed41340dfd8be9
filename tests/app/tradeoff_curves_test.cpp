// Work-precision curves of mechanisms of the gallery, as `tradeoff` measures and draws them. What is within a budget is
// counted, not timed, so the points are the same on any machine.
#include <catch2/catch.hpp>
#include <set>
#include <string>

#include "app/json/read_problem.hpp"
#include "optim/tradeoff/tradeoff.hpp"
#include "tests/app/gallery_files.hpp"
#include "tests/optim/counted_clock.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

struct Swept {
  std::string name;
  std::vector<std::string> sets;
  double budget;
};

}  // namespace

TEST_CASE("work-precision curves are monotone in work and bound, gradients included, and bounds are close to errors",
          "[tradeoff]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Swept swept =
      GENERATE(Swept{"five_bar/design", {"simulation.end_time=1"}, 1}, Swept{"andrews/simulate", {}, 0.5},
               Swept{"governor/stiff_flyball", {"simulation.end_time=0.1"}, 2},
               Swept{"four_bar/windows",
                     {"simulation.end_time=2", "simulation.integrator.max_steps=5000"},
                     0.5});  // past two singular positions
  INFO(swept.name);
  const Problem problem = read_problem(file_of(swept.name), swept.sets);
  CountedClock clock;
  TradeoffOptions options;
  options.budget_seconds = swept.budget, options.clock = clock.clock();
  const Tradeoff tradeoff = measure_tradeoff(problem.scene, objectives_of(problem), options);
  REQUIRE(tradeoff.ok());
  const std::vector<Quantity>& quantities = tradeoff.quantities();
  int points = 0, drawn = 0, close = 0, gradients = 0;
  for (std::size_t q = 0; q < quantities.size(); ++q) {
    const auto column = static_cast<Eigen::Index>(q);
    for (const WorkPrecisionCurve& curve : work_precision_curves(tradeoff.rows, quantities, q)) {
      INFO(curve.name << ", " << quantities[q].name);
      drawn += static_cast<int>(curve.line.size());
      if (quantities[q].kind == QuantityKind::gradient) gradients += static_cast<int>(curve.line.size());
      for (std::size_t k = 1; k < curve.line.size(); ++k) {
        const TradeoffRow &looser = tradeoff.rows[curve.line[k - 1]], &tighter = tradeoff.rows[curve.line[k]];
        CHECK(tighter.bounds(column) <= looser.bounds(column));
        CHECK(tighter.statistics.rhs_evaluations > looser.statistics.rhs_evaluations);
      }
    }
    for (const TradeoffRow& row : tradeoff.rows) {
      if (row.setting.stands_alone() || !better_than_zero(quantities[q], row.bounds(column))) continue;
      CHECK(row.bounds(column) >= row.errors(column));
      ++points;
      if (row.bounds(column) <= 3 * row.errors(column)) ++close;
    }
  }
  INFO(points << " points, " << drawn << " drawn, " << gradients << " of gradients, " << close << " close");
  CHECK(gradients > 20);
  CHECK(drawn >= 0.9 * points);
  // A bound that says little would be monotone, too: most are the error itself or next to it.
  CHECK(close >= 0.9 * points);
}
