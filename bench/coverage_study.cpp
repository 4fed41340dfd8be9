// How often 95 % intervals of identify hold the truth: 200 noisy repetitions of three problems (tests/optim/
// repetitions.hpp), linear intervals. Between 92 % and 98 % is what 200 repetitions of a right interval give.
//   coverage_<k>: part of the repetitions, in % ; least, most: over the parameters
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>

#include "optim/fit/identification.hpp"
#include "tests/optim/repetitions.hpp"

using namespace mbsopt;

namespace {

constexpr unsigned kRepetitions = 200;

void coverage(benchmark::State& state) {
  const repetitions::Study study = repetitions::studies()[static_cast<std::size_t>(state.range(0))];
  state.SetLabel(study.name);
  std::vector<double> covered(study.truth.size(), 0);
  for (auto _ : state) {
    for (unsigned run = 0; run < kRepetitions; ++run) {
      const IdentificationResult result = run_identification(study.problem, repetitions::repeated(study, run));
      if (!result.ok()) {
        state.SkipWithError(result.message.c_str());
        return;
      }
      for (std::size_t k = 0; k < covered.size(); ++k)
        covered[k] += result.parameters[k].ci95[0] <= study.truth[k] && study.truth[k] <= result.parameters[k].ci95[1];
    }
  }
  for (double& c : covered) c *= 100. / kRepetitions;
  for (std::size_t k = 0; k < covered.size(); ++k) state.counters[fmt::format("coverage_{}", k)] = covered[k];
  state.counters["least"] = *std::min_element(covered.begin(), covered.end());
  state.counters["most"] = *std::max_element(covered.begin(), covered.end());
}
BENCHMARK(coverage)->DenseRange(0, 2)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
