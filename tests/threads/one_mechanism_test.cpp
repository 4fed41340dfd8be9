#include <catch2/catch.hpp>
#include <string>
#include <thread>
#include <vector>

#include "core/cvodes/cvodes.hpp"
#include "core/mechanism/mechanism.hpp"
#include "optim/objective/evaluator.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// The results of each thread must equal those of a single thread, bit by bit.
struct Computed {
  double psi = 0;
  MatrixXd psi_rho;
  bool operator==(const Computed& other) const { return psi == other.psi && psi_rho == other.psi_rho; }
};

// The results of four threads that compute the same at once.
template <class Compute>
std::vector<Computed> in_threads(const Compute& compute) {
  std::vector<Computed> results(4);
  std::vector<std::thread> threads;
  for (Computed& result : results) threads.emplace_back([&] { result = compute(); });
  for (std::thread& thread : threads) thread.join();
  return results;
}

}  // namespace

TEST_CASE("one mechanism and one cost serve the simulations and gradients of several threads", "[threads]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  problem.scene.simulation.integrator.type =
      GENERATE(as<std::string>{}, "dopri853", "radau5", "cvodes_adams", "cvodes_bdf");
  INFO(problem.scene.simulation.integrator.type);
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  const std::vector<Cost> costs{Objective(problem.scene, problem.objectives.front()).cost(mechanism)};
  const auto compute = [&] {
    const SimulationSettings& settings = problem.scene.simulation;
    const SimulationResult run = simulate(mechanism, settings, costs);
    const SimulationResult back = simulate_adjoint(mechanism, settings, costs);
    const SimulationResult tangent = simulate_tlm(mechanism, settings, costs);
    return Computed{run.psi(0) + back.psi(0) + tangent.psi(0), back.psi_rho + 3 * tangent.psi_rho};
  };
  const Computed alone = compute();
  CHECK(alone.psi > 0);
  CHECK(alone.psi_rho.norm() > 0);
  for (const Computed& result : in_threads(compute)) CHECK(result == alone);
}

TEST_CASE("each thread may have an evaluator of one problem", "[threads]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  const auto compute = [&] {
    Evaluator evaluator(problem.scene, objectives_of(problem), {"L01", "k1"});
    const Evaluation& e = evaluator.gradients(evaluator.start());
    return Computed{e.ok ? e.psi(0) : 0, e.psi_rho};
  };
  const Computed alone = compute();
  CHECK(alone.psi > 0);
  for (const Computed& result : in_threads(compute)) CHECK(result == alone);
}
