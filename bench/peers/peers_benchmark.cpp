// mbsopt and other programs on the same mechanisms, in turn within one run.
//   peers_right_hand_side   <program>_us: accelerations at the start, median [microseconds]; <program>_ratio: to
//   mbsopt,
//                           median of the rounds' ratios; <program>_apart: largest difference of the accelerations of a
//                           rod's centre, relative to the largest (MuJoCo's loops are regularised)
//   peers_time_to_error     a motion of 10 s (time_to_error_benchmark.cpp: what the error is): <program>_ms and
//                           <program>_error of the coarsest of its settings that meets `wanted`, else of the most exact
//                           that ended within its time; mbsopt_ms at an error no larger than that
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>

#include "bench/peers/peer.hpp"
#include "bench/reference_motion.hpp"
#include "bench/repeated.hpp"
#include "bench/right_hand_side.hpp"

using namespace mbsopt;
using namespace mbsopt::bench;

namespace {

constexpr double kMostSeconds = 5;  // of a run
constexpr double kLost = 0.1;       // an error that is none of tolerances [m]

struct Program {
  std::string name;
  std::unique_ptr<Peer> peer;
};
std::vector<Program> programs([[maybe_unused]] const Linkage& linkage) {
  std::vector<Program> all;
#ifdef MBSOPT_PEER_SIMBODY
  all.push_back({"simbody", simbody_peer(linkage)});
#endif
#ifdef MBSOPT_PEER_MUJOCO
  all.push_back({"mujoco", mujoco_peer(linkage)});
#endif
#ifdef MBSOPT_PEER_DART
  all.push_back({"dart", dart_peer(linkage)});
#endif
  std::erase_if(all, [](const Program& p) { return !p.peer; });
  return all;
}

double apart(Peer& peer, const RightHandSide& ours, int rods) {
  double most = 0, size = 0;
  for (int i = 0; i < rods; ++i) {
    most = std::max(most, (peer.acceleration(i) - ours.acceleration(i)).norm());
    size = std::max(size, ours.acceleration(i).norm());
  }
  return most / size;
}

void right_hand_side(benchmark::State& state, const Linkage& linkage) {
  RightHandSide ours = RightHandSide::of(linkage, models_of(linkage).front());
  std::vector<Program> all = programs(linkage);
  for (auto _ : state) {
    const long count = repetitions(ours);
    std::vector<long> counts;
    for (Program& p : all) counts.push_back(repetitions([&] { p.peer->right_hand_side(); }));
    std::vector<double> us;
    std::vector<std::vector<double>> theirs(all.size()), ratios(all.size());
    for (int round = 0; round < 9; ++round) {
      us.push_back(1e6 * seconds_of(ours, count));
      for (std::size_t k = 0; k < all.size(); ++k) {
        theirs[k].push_back(1e6 * seconds_of([&] { all[k].peer->right_hand_side(); }, counts[k]));
        ratios[k].push_back(theirs[k].back() / us.back());
      }
    }
    state.counters["bodies"] = linkage.size();
    state.counters["mbsopt_us"] = median(us);
    for (std::size_t k = 0; k < all.size(); ++k) {
      state.counters[all[k].name + "_us"] = median(theirs[k]);
      state.counters[all[k].name + "_ratio"] = median(ratios[k]);
      state.counters[all[k].name + "_apart"] = apart(*all[k].peer, ours, linkage.size());
    }
  }
}

// Of the times of one level: the error, and the processor time of a run of its own that stops at the end only.
struct PeerRun {
  double error = INFINITY, seconds = INFINITY;
  std::string level;
};
PeerRun best_run(Peer& peer, const ReferenceMotion& reference, double wanted, double most_seconds) {
  PeerRun best;
  for (int level = 0; level < peer.levels(); ++level) {
    const auto motion = peer.run(level, reference.times, most_seconds);
    if (!motion) break;
    const double error = reference.distance(*motion);
    if (!(error < best.error)) continue;
    best.error = error, best.level = peer.level_name(level);
    best.seconds = seconds_of([&] { peer.run(level, {reference.times.back()}, 2 * most_seconds); }, 1);
    if (error <= wanted) break;
  }
  return best;
}

void time_to_error(benchmark::State& state, const Linkage& linkage, const ReferenceMotion& reference, double wanted) {
  MeasuredRuns ours(linkage, models_of(linkage).front(), reference);
  for (auto _ : state) {
    std::string label;
    state.counters["wanted"] = wanted;
    for (Program& p : programs(linkage)) {
      if (p.peer->levels() == 0) continue;
      const PeerRun theirs = best_run(*p.peer, reference, wanted, kMostSeconds);
      if (!std::isfinite(theirs.error)) {
        label += fmt::format("{}: no run ended within {} s; ", p.name, kMostSeconds);
        continue;
      }
      if (theirs.error > kLost) {
        label += fmt::format("{}: leaves the motion at every accuracy; ", p.name);
        continue;
      }
      const MeasuredRun run = ours.fastest(theirs.error);
      label += fmt::format("{}: {}, mbsopt: {} at {:.0e}; ", p.name, theirs.level, run.method, run.rtol);
      state.counters[p.name + "_ms"] = 1e3 * theirs.seconds;
      state.counters[p.name + "_error"] = theirs.error;
      state.counters["mbsopt_ms_for_" + p.name] = 1e3 * run.seconds;
      state.counters["mbsopt_error_for_" + p.name] = run.error;
    }
    state.SetLabel(label);
  }
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto&& run) {
    benchmark::RegisterBenchmark(name.c_str(), run)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  const auto compare = [&](const std::string& name, const Linkage& linkage) {
    add("peers_right_hand_side/" + name, [=](benchmark::State& state) { right_hand_side(state, linkage); });
  };
  for (const int size : {10, 50, 200}) compare(fmt::format("planar_chain/{}", size), planar_chain(size));
  for (const int size : {10, 50, 200}) compare(fmt::format("spatial_chain/{}", size), spatial_chain(size));
  compare("tree/200", tree(200));
  for (const int windows : {1, 10, 40}) compare(fmt::format("four_bars/{}", windows), four_bars(windows));
  compare("bricard", bricard());
  for (const int windows : {10, 40}) {
    add(fmt::format("peers_time_to_error/four_bars/{}", windows),
        [=](benchmark::State& state) { time_to_error(state, four_bars(windows), motion_of_four_bars(windows), 1e-4); });
  }
  add("peers_time_to_error/bricard",
      [](benchmark::State& state) { time_to_error(state, bricard(), motion_of_bricard(), 1e-5); });
  return true;
}();

}  // namespace
