// How long a motion of 10 s takes to an error that was asked for: the largest distance of any rod's centre of mass from
// where it should be, at 201 times.
//   ms, error, rtol, steps, rhs        of the fastest run that meets it (reference_motion.hpp); the label: its method
//   assembly_ms                        of ms, what the initial assembly takes
//   default_ms, default_error          of the default method and tolerances
//   reference_apart                    what two references differ by [m]; 0: the motion is known exactly
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "bench/models.hpp"
#include "bench/reference_motion.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

void time_to_error(benchmark::State& state, const Linkage& linkage, const std::string& model,
                   ReferenceMotion (*motion)(int), int size, double wanted) {
  for (auto _ : state) {
    const ReferenceMotion reference = motion(size);
    MeasuredRuns runs(linkage, model, reference);
    const MeasuredRun best = runs.fastest(wanted);
    if (!std::isfinite(best.seconds)) return state.SkipWithError("no tolerance met the error");
    const IntegratorSettings defaults;
    const MeasuredRun standard = runs.run(defaults.type, defaults.rtol);
    state.SetLabel(best.method);
    state.counters["ms"] = 1e3 * best.seconds;
    state.counters["assembly_ms"] = 1e3 * runs.start_seconds();
    state.counters["error"] = best.error;
    state.counters["rtol"] = best.rtol;
    state.counters["steps"] = static_cast<double>(best.statistics.steps);
    state.counters["rhs"] = static_cast<double>(best.statistics.rhs_evaluations);
    state.counters["default_ms"] = 1e3 * standard.seconds;
    state.counters["default_error"] = standard.error;
    state.counters["reference_apart"] = reference.apart;
    state.counters["wanted"] = wanted;
  }
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto&& run) {
    benchmark::RegisterBenchmark(("time_to_error/" + name).c_str(), run)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  for (const int windows : {10, 40}) {
    const Linkage linkage = four_bars(windows);
    for (const std::string& model : models_of(linkage)) {
      add(fmt::format("four_bars/{}/{}", windows, model),
          [=](benchmark::State& state) { time_to_error(state, linkage, model, motion_of_four_bars, windows, 1e-5); });
    }
  }
  add("bricard", [](benchmark::State& state) {
    time_to_error(
        state, bricard(), "spatial", [](int) { return motion_of_bricard(); }, 1, 1e-6);
  });
  return true;
}();

}  // namespace
