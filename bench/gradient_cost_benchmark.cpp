// Cost of gradients in simulations, of problems with 20 and more parameters. What one simulation is, and how
// simulation, adjoint and TLM are timed in turn, says optim/check/gradient_timing.hpp; `mbsopt check` prints the same
// figures.
//   adjoint_ratio = adjoint / simulation          tlm_over_parameters = (TLM / simulation - 1) / parameters
#include <benchmark/benchmark.h>

#include "app/json/read_problem.hpp"
#include "optim/check/gradient_timing.hpp"
#include "optim/objective/objective.hpp"

using namespace mbsopt;

namespace {

void gradient_cost(benchmark::State& state, const char* file, const char* method) {
  Problem problem = read_problem(std::string(MBSOPT_SOURCE_DIR "/problems/") + file);
  problem.scene.simulation.integrator.type = method;
  const auto parameters = static_cast<double>(problem.scene.parameters.size());
  const auto bodies = static_cast<double>(problem.scene.bodies.size());
  const std::vector<Objective> objectives = objectives_of(problem);
  for (auto _ : state) {
    const GradientTiming timing = time_gradients(problem.scene, objectives);
    if (!timing.ok) {
      state.SkipWithError(timing.message.c_str());
      return;
    }
    state.counters["bodies"] = bodies;
    state.counters["parameters"] = parameters;
    state.counters["steps"] = static_cast<double>(timing.steps);
    state.counters["rhs_us_per_body"] =
        1e6 * timing.simulation.wall_seconds / static_cast<double>(timing.rhs_evaluations) / bodies;
    state.counters["adjoint_ratio"] = timing.adjoint.ratio;
    state.counters["tlm_over_parameters"] = (timing.tlm.ratio - 1) / parameters;
  }
}

}  // namespace

#define MBSOPT_GRADIENT_COST(name, file, method) \
  BENCHMARK_CAPTURE(gradient_cost, name, file, method)->Iterations(1)->Unit(benchmark::kMillisecond)

MBSOPT_GRADIENT_COST(five_bar_dopri5, "five_bar/sensitivities.json", "dopri5");
MBSOPT_GRADIENT_COST(five_bar_dopri853, "five_bar/sensitivities.json", "dopri853");
MBSOPT_GRADIENT_COST(five_bar_radau5, "five_bar/sensitivities.json", "radau5");
MBSOPT_GRADIENT_COST(five_bar_sdirk4, "five_bar/sensitivities.json", "sdirk4");
MBSOPT_GRADIENT_COST(five_bar_gauss6, "five_bar/sensitivities.json", "gauss6");
MBSOPT_GRADIENT_COST(five_bar_lobatto3c, "five_bar/sensitivities.json", "lobatto3c");
MBSOPT_GRADIENT_COST(five_bar_radau1a, "five_bar/sensitivities.json", "radau1a");
MBSOPT_GRADIENT_COST(five_bar_rodas4, "five_bar/sensitivities.json", "rodas4");
MBSOPT_GRADIENT_COST(chain_20_dopri5, "chain/gradient.json", "dopri5");
MBSOPT_GRADIENT_COST(chain_20_dopri853, "chain/gradient.json", "dopri853");
MBSOPT_GRADIENT_COST(chain_20_radau5, "chain/gradient.json", "radau5");
MBSOPT_GRADIENT_COST(chain_20_sdirk4, "chain/gradient.json", "sdirk4");
MBSOPT_GRADIENT_COST(chain_20_gauss6, "chain/gradient.json", "gauss6");
MBSOPT_GRADIENT_COST(chain_20_lobatto3c, "chain/gradient.json", "lobatto3c");
MBSOPT_GRADIENT_COST(chain_20_radau1a, "chain/gradient.json", "radau1a");
MBSOPT_GRADIENT_COST(chain_20_rodas4, "chain/gradient.json", "rodas4");
MBSOPT_GRADIENT_COST(stiff_governor_radau5, "governor/stiff_flyball.json", "radau5");
MBSOPT_GRADIENT_COST(stiff_governor_sdirk4, "governor/stiff_flyball.json", "sdirk4");
