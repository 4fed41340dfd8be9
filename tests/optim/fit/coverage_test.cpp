// Whether 95 % intervals hold the truth in 95 % of noisy repetitions; 200 repetitions are in bench/coverage_study.cpp.
#include <catch2/catch.hpp>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;

TEST_CASE("95 % intervals cover the truth about as often as they say, on three problems",
          "[identification][coverage]") {
#ifdef __SANITIZE_ADDRESS__
  constexpr unsigned kRuns = 2;  // twenty times slower: only that they run
#else
  constexpr unsigned kRuns = 40;
#endif
  for (const repetitions::Study& study : repetitions::studies()) {
    std::vector<unsigned> covered(study.truth.size(), 0);
    for (unsigned run = 0; run < kRuns; ++run) {
      const IdentificationResult result = run_identification(study.problem, repetitions::repeated(study, run));
      INFO(study.name << ", repetition " << run << ": " << result.message);
      REQUIRE(result.ok());
      REQUIRE(result.parameters.size() == study.truth.size());
      for (std::size_t k = 0; k < covered.size(); ++k)
        covered[k] += result.parameters[k].ci95[0] <= study.truth[k] && study.truth[k] <= result.parameters[k].ci95[1];
    }
    for (std::size_t k = 0; k < covered.size(); ++k) {
      INFO(study.name << ", parameter " << k);
      if (kRuns == 40) CHECK(covered[k] >= 33);  // 38 expected, 3.6 standard deviations of the binomial below
    }
  }
}
