// An adjoint run stays within its budget of memory, by the count of every allocation of the process.
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

TEST_CASE("1e5 steps go back within 16 MiB, with the gradient of unlimited memory", "[allocation]") {
  Scene scene = pendulum();
  scene.gravity = {0.0, -9.81, 0.0};
  scene.simulation.end_time = 100;
  scene.simulation.integrator.type = "rk4";
  scene.simulation.integrator.step = 1e-3;
  const Mechanism mechanism(scene, nominal(scene));
  Cost cost;
  cost.running = cost.terminal = std::make_shared<StateNorm>();
  cost.samples = {{50.0005, std::make_shared<StateNorm>()}, {3.25, std::make_shared<StateNorm>()}};
  const std::vector<Cost> costs{cost};
  const auto run = [&](double mib) {
    scene.simulation.adjoint_memory_mib = mib;
    const long before = allocated_bytes();
    restart_most_allocated();
    const SimulationResult result = simulate_adjoint(mechanism, scene.simulation, costs);
    return std::pair(result, most_allocated_bytes() - before);
  };
  const auto [bound, bound_bytes] = run(16);
  const auto [free, free_bytes] = run(1e6);
  INFO(bound.message << "allocated " << bound_bytes << " and " << free_bytes << " bytes, counted "
                     << bound.statistics.adjoint_memory_bytes << " and " << free.statistics.adjoint_memory_bytes
                     << ", recomputed " << bound.statistics.recomputed_steps);
  REQUIRE((bound.ok() && free.ok()));
  CHECK(bound.statistics.steps == 100000);
  constexpr long kBudget = 16 * 1024 * 1024, kWorkspaces = 1024 * 1024;  // of the run, the sweep and the replay
  CHECK(bound.statistics.adjoint_memory_bytes <= static_cast<std::size_t>(kBudget));
  CHECK(bound_bytes <= kBudget + kWorkspaces);
  CHECK(free_bytes > 4 * kBudget);
  // The count is what was allocated.
  CHECK(static_cast<double>(free.statistics.adjoint_memory_bytes) ==
        Approx(static_cast<double>(free_bytes)).epsilon(0.15));
  CHECK(bound.statistics.recomputed_steps <= 100000);
  CHECK(bound.psi_rho == free.psi_rho);
}
