#include "optim/tradeoff/tradeoff.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <stdexcept>

#include "tests/optim/counted_clock.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

TEST_CASE("alphas are powers of ten over a range, or a list; anything else is refused", "[penalty_study]") {
  const std::vector<double> range = alphas_of("1e2:1e16");
  REQUIRE(range.size() == 15);
  CHECK(range.front() == 1e2);
  CHECK(range[7] == Approx(1e9));
  CHECK(range.back() == Approx(1e16));
  CHECK(alphas_of("1e5,3e7") == std::vector<double>{1e5, 3e7});
  CHECK(alphas_of("1e9") == std::vector<double>{1e9});
  for (const char* wrong : {"", "1e9:", "1e9:1e3", "ten", "-1", "0:1e3", "1e2,,1e3", "1:1e300", "inf"}) {
    INFO(wrong);
    CHECK_THROWS_AS(alphas_of(wrong), std::invalid_argument);
  }
}

TEST_CASE("alpha: the model's error falls as 1/alpha, Cholesky's rounding grows with it", "[penalty_study]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  Problem p = five_bar::problem();
  p.scene.simulation.end_time = 0.3;
  CountedClock clock;
  TradeoffOptions options;
  options.budget_seconds = 4, options.clock = clock.clock();
  const PenaltyStudy study = study_penalty(p.scene, objectives_of(p), {1e3, 1e5, 1e7, 1e14}, options);
  INFO(study.table.message);
  REQUIRE(study.table.ok());
  REQUIRE(study.rows.size() == 4);
  CHECK(study.formulation.omega == 10);  // MBSVT's
  for (std::size_t i = 1; i < 3; ++i) {
    const PenaltyStudyRow &before = study.rows[i - 1], &row = study.rows[i];
    const TradeoffRow &run = study.table.rows[row.quasidefinite], &run_before = study.table.rows[before.quasidefinite];
    CHECK(before.model_error / row.model_error == Approx(100).epsilon(0.2));
    CHECK(row.rounding_error > 3 * before.rounding_error);
    REQUIRE(run.ok());
    for (Eigen::Index q : {0, 2}) {  // motion, psi
      CHECK(run.errors(q) < 0.1 * run_before.errors(q));
      CHECK(before.rounding(q) < 1e-3 * run_before.errors(q));
      CHECK(row.rounding(q) > before.rounding(q));
    }
    CHECK(run.statistics.max_position_violation < 0.1 * run_before.statistics.max_position_violation);
  }
  const PenaltyStudyRow& extreme = study.rows.back();
  CHECK(extreme.rounding_error > 1e-4);
  CHECK(extreme.model_error < 1e-10);
  CHECK(study.rows[2].augmented_error < 1e-11);
  CHECK(study.table.rows.front().ok());
}
