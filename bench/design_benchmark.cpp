// Five bars on two springs (FB-1), whose optimum is known: what the whole optimisation takes, and a Hessian.
//   ms                        processor time from the problem to its optimum, median; reading the file is not in it
//   optimizer_iterations, evaluations, simulations  of it;  optimum_error: the larger error of the two lengths,
//   relative hessian_ratio             a full Hessian in ten parameters over one simulation
#include <benchmark/benchmark.h>

#include "app/json/read_problem.hpp"
#include "bench/repeated.hpp"
#include "optim/design/design.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/objective/objective.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

constexpr double kOptimum[] = {2.1469536808839935, 1.9183006617287768};  // the springs hold the mechanism still

void design(benchmark::State& state) {
  const Problem problem = read_problem(MBSOPT_SOURCE_DIR "/problems/five_bar/design.json");
  for (auto _ : state) {
    DesignResult result;
    state.counters["ms"] = 1e3 * median_seconds([&] { result = run_design(problem); }, 9);
    if (!result.ok()) return state.SkipWithError(result.message.c_str());
    state.counters["optimizer_iterations"] = result.iterations;
    state.counters["evaluations"] = static_cast<double>(result.evaluations);
    state.counters["simulations"] = static_cast<double>(result.simulations);
    double error = 0;
    for (std::size_t k = 0; k < 2; ++k) error = std::max(error, std::abs(result.variables[k].value / kOptimum[k] - 1));
    state.counters["optimum_error"] = error;
  }
}
BENCHMARK(design)->Name("design/five_bar")->Iterations(1)->Unit(benchmark::kMillisecond);

void hessian(benchmark::State& state) {
  const Problem problem = read_problem(MBSOPT_SOURCE_DIR "/problems/five_bar/design.json");
  const std::vector<Objective> objectives = objectives_of(problem);
  for (auto _ : state) {
    const auto evaluator = [&] {
      return Evaluator(problem.scene, objectives, {}, {GradientMethod::adjoint, {}, {}, {}});
    };
    const double simulation = median_seconds([&] {
      Evaluator fresh = evaluator();
      fresh.values(fresh.start());
    });
    long gradients = 0;
    const double whole = median_seconds(
        [&] {
          Evaluator fresh = evaluator();
          gradients = hessians(fresh, fresh.start()).gradients;
        },
        3);
    state.counters["hessian_ratio"] = whole / simulation;
    state.counters["gradients"] = static_cast<double>(gradients);
  }
}
BENCHMARK(hessian)->Name("hessian/five_bar")->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
