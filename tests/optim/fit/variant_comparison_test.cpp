#include "optim/fit/variant_comparison.hpp"

#include <catch2/catch.hpp>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

TEST_CASE("F-test: a parameter that the data need, and as many fits as chance allows without", "[identification]") {
  const repetitions::Study study = repetitions::studies()[1];
  Problem held = study.problem;  // with k, the first variable, where it is true; then far off
  const std::string name = held.identification->variables.front();
  held.identification->variables.erase(held.identification->variables.begin());
  int below_a_tenth = 0, below_a_half = 0;
  constexpr int kRuns = 40;
  for (unsigned run = 0; run < kRuns; ++run) {
    const std::vector<CsvTable> data = repetitions::repeated(study, run);
    const IdentificationResult all = run_identification(study.problem, data);
    if (run == 0)
      for (Parameter& p : held.scene.parameters)
        if (p.name == name) p.value = study.truth.front();
    const IdentificationResult fewer = run_identification(held, data);
    const VariantComparison test = compare_variants(fewer, all);
    INFO(test.none);
    REQUIRE(test.none.empty());
    CHECK(test.second);
    CHECK(test.more == 1);
    CHECK(test.freedom == all.statistics.degrees_of_freedom);
    below_a_tenth += test.p < 0.1, below_a_half += test.p < 0.5;
    if (run > 0) continue;
    Problem wrong = held;
    for (Parameter& p : wrong.scene.parameters)
      if (p.name == name) p.value *= 1.1;
    CHECK(compare_variants(run_identification(wrong, data), all).p < 1e-6);
    IdentificationResult finer = all;  // its own sigmas, which the comparison does not take
    for (ChannelFit& channel : finer.experiments[0].channels) channel.sigma /= 2;
    const VariantComparison scaled = compare_variants(fewer, finer);
    CHECK(scaled.rms_scaled[0] * scaled.rms_scaled[0] - scaled.rms_scaled[1] * scaled.rms_scaled[1] > 0);
    CHECK(compare_variants(finer, fewer).rms_scaled[1] == scaled.rms_scaled[0]);
    CHECK_THAT(compare_variants(all, all).none, Contains("as many parameters"));
    CHECK_THAT(compare_variants(all, run_identification(study.problem, repetitions::repeated(study, 99))).none,
               Contains("different samples"));
  }
  CHECK(below_a_tenth >= 1);  // 4 +- 2 of 40
  CHECK(below_a_tenth <= 9);
  CHECK(below_a_half >= 11);  // 20 +- 3
  CHECK(below_a_half <= 29);
}
