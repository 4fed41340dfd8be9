#include "core/integrate/checkpoints.hpp"

#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// (s + r)!/(s! r!)
double beta(long s, long r) {
  double value = r < 0 ? 0 : 1;
  for (long i = 1; i <= r; ++i) value *= static_cast<double>(s + i) / static_cast<double>(i);
  return value;
}
// The least number of block evaluations: t(N, s) = r N - beta(s + 1, r - 1), r the least with beta(s, r) >= N.
double least_cost(long blocks, long snapshots) {
  const double N = static_cast<double>(blocks);
  long r = 0;
  while (beta(snapshots, r) < N - 0.5) ++r;
  return static_cast<double>(r) * N - beta(snapshots + 1, r - 1);
}
// The number by the splits of the rule.
double cost(long blocks, long snapshots) {
  if (blocks == 1) return 0;
  if (snapshots == 1) return static_cast<double>(blocks * (blocks - 1) / 2);
  const long m = binomial_split(blocks, snapshots);
  return static_cast<double>(m) + cost(blocks - m, snapshots - 1) + cost(m, snapshots);
}

// A run whose step i holds the number i in its state: what is replayed and what comes back can be told apart.
struct CountedRun {
  const Method& rk = *explicit_method("dopri5");
  static constexpr Eigen::Index kStates = 6;

  Step step(long i) const {
    Step s;
    s.t = static_cast<double>(i), s.h = 1, s.t1 = s.t + 1;
    s.y0 = s.y_hat = VectorXd::Constant(kStates, static_cast<double>(i));
    s.y1 = VectorXd::Constant(kStates, static_cast<double>(i + 1));
    s.angles0 = s.angles1 = VectorXd::Zero(0);
    s.Y = s.K = Eigen::MatrixXd::Zero(kStates, rk.dense_stages);
    s.lambda.setZero(2, rk.dense_stages);
    return s;
  }

  struct Outcome {
    long recomputed = 0;
    std::size_t peak = 0;
    bool right = true;
  };
  Outcome go(long steps, double budget_mib) const {
    Checkpoints checkpoints(rk, budget_mib);
    for (long i = 0; i < steps; ++i) checkpoints.keep(step(i), {});
    Outcome outcome;
    long next = steps - 1;
    const bool done = checkpoints.go_back(
        [&](const Snapshot& from, long last, StepObserver& sink) {
          outcome.right = outcome.right && from.y0(0) == static_cast<double>(from.step) && last > from.step;
          for (long i = from.step; i < last; ++i) {
            const Step s = step(i);
            sink.look_at({{s.t, s.y0, s.angles0}, {s.t1, s.y1, s.angles1}, 0, &s});
          }
          return true;
        },
        [&](const StoredStep& s) {
          outcome.right = outcome.right && s.y0()(0) == static_cast<double>(next) && s.t == static_cast<double>(next);
          --next;
          return true;
        });
    outcome.right = outcome.right && done && next == -1;
    outcome.recomputed = checkpoints.recomputed_steps();
    outcome.peak = checkpoints.peak_bytes();
    return outcome;
  }
};

Cost sampled_cost() {
  Cost cost;
  cost.running = cost.terminal = std::make_shared<StateNorm>();
  for (const double t : {0.0, 0.01, 0.2, 0.2001, 0.33, 0.48}) {
    cost.samples.push_back({t, std::make_shared<StateNorm>()});
  }
  return cost;
}

}  // namespace

TEST_CASE("the binomial rule places snapshots with nearly the least recomputation", "[checkpoints]") {
  for (long snapshots = 2; snapshots <= 8; ++snapshots) {
    for (long blocks = 2; blocks <= 60; ++blocks) {
      const long m = binomial_split(blocks, snapshots);
      INFO(blocks << " blocks, " << snapshots << " snapshots, split after " << m);
      REQUIRE(m >= 1);
      REQUIRE(m < blocks);
      CHECK(cost(blocks, snapshots) <= 1.04 * least_cost(blocks, snapshots));
    }
  }
}

TEST_CASE("every step comes back once, in order, whatever the budget", "[checkpoints]") {
  const CountedRun run;
  for (const long steps : {1L, 2L, 7L, 100L, 1000L, 4096L}) {
    for (const double mib : {1e-9, 0.02, 0.1, 0.5, 64.0}) {
      const CountedRun::Outcome outcome = run.go(steps, mib);
      INFO(steps << " steps, " << mib << " MiB: peak " << outcome.peak << ", recomputed " << outcome.recomputed);
      CHECK(outcome.right);
      // At 32 bytes per step the list of the steps alone passes the smallest budgets.
      if (mib * 1024 * 1024 > 3e4 + 40.0 * static_cast<double>(steps)) {
        CHECK(static_cast<double>(outcome.peak) <= mib * 1024 * 1024);
      }
      if (mib == 64.0) CHECK(outcome.recomputed == 0);
    }
  }
}

TEST_CASE("recomputation grows as the binomial rule promises", "[checkpoints]") {
  const CountedRun run;
  // Where snapshots of the forward run lie so near that the steps between two of them fit: each step once.
  CHECK(run.go(4096, 1.0).recomputed <= 4096);
  // With next to nothing: the least allowance holds 2 steps and 8 snapshots, at most 4 of these from the forward run.
  // So no interval is longer than half of the run, and single steps are reversed from 4 snapshots or more.
  for (const long steps : {100L, 1000L, 4096L}) {
    const CountedRun::Outcome outcome = run.go(steps, 1e-9);
    const long longest = steps / 2 + 1;
    INFO(steps << " steps: " << outcome.recomputed);
    CHECK(outcome.recomputed > steps);
    CHECK(static_cast<double>(outcome.recomputed) <= 2 * (least_cost(longest, 4) + static_cast<double>(longest)));
  }
}

TEST_CASE("a gradient is the same to the last bit whatever the memory", "[checkpoints]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.48;
  scene.simulation.integrator.type = GENERATE(as<std::string>{}, "dopri5", "dopri853", "rk4");
  if (scene.simulation.integrator.type == "rk4") scene.simulation.integrator.step = 0.001;
  scene.simulation.integrator.max_step = 0.002;
  const Mechanism mechanism(scene, nominal(scene));
  const std::vector<Cost> costs{sampled_cost()};
  const SimulationResult free = simulate_adjoint(mechanism, scene.simulation, costs);
  REQUIRE(free.ok());
  CHECK(free.statistics.recomputed_steps == 0);
  for (const double mib : {0.15, 1e-6}) {
    scene.simulation.adjoint_memory_mib = mib;
    const SimulationResult bound = simulate_adjoint(mechanism, scene.simulation, costs);
    INFO(scene.simulation.integrator.type << ", " << mib << " MiB: " << free.statistics.steps << " steps, "
                                          << bound.statistics.recomputed_steps << " recomputed");
    REQUIRE(bound.ok());
    CHECK(bound.psi == free.psi);
    CHECK(bound.psi_rho == free.psi_rho);
    CHECK(bound.statistics.adjoint_memory_bytes < free.statistics.adjoint_memory_bytes);
    if (mib < 0.1) CHECK(bound.statistics.recomputed_steps > bound.statistics.steps);
  }
}

TEST_CASE("with implicit stages it is the same to the rounding that their equations are solved to", "[checkpoints]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.48;
  scene.simulation.integrator.type = GENERATE(as<std::string>{}, "radau5", "sdirk4");
  scene.simulation.integrator.rtol = 1e-4;
  const Mechanism mechanism(scene, nominal(scene));
  const std::vector<Cost> costs{sampled_cost()};
  const SimulationResult free = simulate_adjoint(mechanism, scene.simulation, costs);
  scene.simulation.adjoint_memory_mib = 1e-6;
  const SimulationResult bound = simulate_adjoint(mechanism, scene.simulation, costs);
  INFO(scene.simulation.integrator.type << ": " << free.message << bound.message);
  REQUIRE((free.ok() && bound.ok()));
  CHECK(bound.statistics.recomputed_steps > 0);
  CHECK((bound.psi_rho - free.psi_rho).cwiseAbs().maxCoeff() < 1e-10 * free.psi_rho.cwiseAbs().maxCoeff());
}
