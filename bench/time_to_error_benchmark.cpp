// How long a motion of 10 s takes to an error that was asked for: the largest distance of any rod's centre of mass from
// where it should be, at 201 times. Methods and tolerances (rtol; atol is a hundredth of it) are tried; what counts is
// the fastest run that meets the error and whose method meets it at a third of the tolerance as well.
//   assembly_ms                        of ms, what the initial assembly takes
//   ms, error, rtol, steps, rhs        of that run; the label names its method
//   default_ms, default_error          of the default method and tolerances
//   reference_apart                    what two references differ by [m]; 0: the motion is known exactly
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>

#include "bench/models.hpp"
#include "bench/repeated.hpp"
#include "core/dynamics/assembly.hpp"
#include "core/integrate/simulation.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

constexpr double kEnd = 10;  // [s]

std::vector<double> sample_times() {
  std::vector<double> times;
  for (int i = 0; i <= 200; ++i) times.push_back(kEnd * i / 200);
  return times;
}

using Motion = std::vector<Eigen::Matrix3Xd>;  // centres of mass of all rods, per time

struct Run {
  std::string method;
  double rtol = 0, error = INFINITY, seconds = 0;
  SimulationStatistics statistics;
};

class Case {
 public:
  Case(const Linkage& linkage, const std::string& model) : scene_(scene_of(linkage)) {
    choose_model(scene_.simulation, model);
    scene_.simulation.end_time = kEnd;
  }

  Motion motion(const std::string& method, double rtol) {
    set(method, rtol);
    Motion centres(sample_times().size());
    const Mechanism mechanism(scene_, Eigen::VectorXd(0));
    const auto observe = [&](std::size_t index, const StatePoint& at) {
      centres[index].resize(3, mechanism.bodies());
      for (int i = 0; i < mechanism.bodies(); ++i) centres[index].col(i) = at.y.segment<3>(7 * i);
    };
    const SimulationResult result = simulate(mechanism, scene_.simulation, {}, {sample_times(), observe});
    if (!result.ok()) centres.clear();
    return centres;
  }
  Run run(const Motion& exact, const std::string& method, double rtol) {
    return {method, rtol, distance(motion(method, rtol), exact), 0, {}};
  }
  void time(Run& run) {
    set(run.method, run.rtol);
    const Mechanism mechanism(scene_, Eigen::VectorXd(0));
    std::vector<double> seconds;
    for (int i = 0; i < 5; ++i) {
      const ThreadClock clock;
      run.statistics = simulate(mechanism, scene_.simulation).statistics;
      seconds.push_back(clock.seconds());
    }
    run.seconds = median(std::move(seconds));
  }
  double start_seconds() const {
    const Mechanism mechanism(scene_, Eigen::VectorXd(0));
    return median_seconds([&] { Assembly(mechanism, 0); }, 3);
  }
  static double distance(const Motion& a, const Motion& b) {
    double most = a.size() == b.size() ? 0.0 : INFINITY;
    for (std::size_t k = 0; k < a.size() && k < b.size(); ++k)
      most = std::max(most, (a[k] - b[k]).colwise().norm().maxCoeff());
    return std::isfinite(most) ? most : INFINITY;
  }

 private:
  void set(const std::string& method, double rtol) {
    IntegratorSettings& integrator = scene_.simulation.integrator;
    integrator.type = method, integrator.rtol = rtol, integrator.atol = 1e-2 * rtol;
  }
  Scene scene_;
};

void report(benchmark::State& state, Case& subject, const Motion& exact, double apart, double wanted) {
  Run best;
  best.seconds = INFINITY;
  for (const char* method : {"dopri5", "verner6", "dopri853"}) {
    std::vector<Run> ladder;
    for (double rtol = 1e-4; rtol > 1e-11; rtol /= std::sqrt(10.0)) {
      ladder.push_back(subject.run(exact, method, rtol));
      if (ladder.size() < 2) continue;
      Run& one = ladder[ladder.size() - 2];
      if (one.error > wanted || ladder.back().error > wanted) continue;
      subject.time(one);
      if (one.seconds < best.seconds) best = one;
      break;
    }
  }
  if (!std::isfinite(best.seconds)) return state.SkipWithError("no tolerance met the error");
  const IntegratorSettings defaults;
  Run standard = subject.run(exact, defaults.type, defaults.rtol);
  subject.time(standard);
  state.SetLabel(best.method);
  state.counters["ms"] = 1e3 * best.seconds;
  state.counters["assembly_ms"] = 1e3 * subject.start_seconds();
  state.counters["error"] = best.error;
  state.counters["rtol"] = best.rtol;
  state.counters["steps"] = static_cast<double>(best.statistics.steps);
  state.counters["rhs"] = static_cast<double>(best.statistics.rhs_evaluations);
  state.counters["default_ms"] = 1e3 * standard.seconds;
  state.counters["default_error"] = standard.error;
  state.counters["reference_apart"] = apart;
  state.counters["wanted"] = wanted;
}

void of_four_bars(benchmark::State& state, int windows, const std::string& model) {
  const Linkage linkage = four_bars(windows);
  Case subject(linkage, model);
  Motion exact;
  for (const double chi : four_bars_angles(windows, sample_times())) {
    Eigen::Matrix3Xd at(3, linkage.size());
    const Vector3d tip(std::sin(chi), std::cos(chi), 0);
    for (int i = 0; i <= windows; ++i) at.col(i) = Vector3d(i, 0, 0) + tip / 2;
    for (int i = 1; i <= windows; ++i) at.col(windows + i) = Vector3d(i - 0.5, 0, 0) + tip;
    exact.push_back(at);
  }
  for (auto _ : state) report(state, subject, exact, 0, 1e-5);
}

void of_bricard(benchmark::State& state) {
  Case subject(bricard(), "spatial");
  const Motion reference = subject.motion("dopri853", 1e-12), second = subject.motion("verner6", 1e-11);
  for (auto _ : state) report(state, subject, reference, Case::distance(reference, second), 1e-6);
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto&& run) {
    benchmark::RegisterBenchmark(("time_to_error/" + name).c_str(), run)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  for (const int windows : {10, 40}) {
    for (const std::string& model : models_of(four_bars(windows))) {
      add(fmt::format("four_bars/{}/{}", windows, model),
          [=](benchmark::State& state) { of_four_bars(state, windows, model); });
    }
  }
  add("bricard", of_bricard);
  return true;
}();

}  // namespace
