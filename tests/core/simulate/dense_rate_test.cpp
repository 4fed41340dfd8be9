// The rate of the dense output, which observers of runs with tangents are given.
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "core/tableau/tableaus.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct Seen {
  std::vector<VectorXd> y, ydot;
  StepSequence steps;
};

Seen seen_at(const Scene& scene, const std::vector<double>& times) {
  Seen seen;
  seen.y.resize(times.size()), seen.ydot.resize(times.size());
  TangentSampling sampling;
  sampling.times = times;
  sampling.observe = [&](std::size_t i, const StatePoint& at, const MatrixXd&) {
    REQUIRE(at.ydot);
    seen.y[i] = at.y, seen.ydot[i] = *at.ydot;
  };
  const Mechanism mechanism(scene, nominal(scene));
  const SimulationResult run = simulate_tlm(mechanism, scene.simulation, {}, sampling);
  INFO(run.message);
  REQUIRE(run.ok());
  seen.steps = run.steps;
  return seen;
}

}  // namespace

TEST_CASE("the rate of the dense output is its derivative, by every method", "[integrate]") {
  std::vector<std::string> methods{"cvodes_adams", "cvodes_bdf"};
  for (const Method& m : runge_kutta_methods()) methods.emplace_back(m.name);
  for (const std::string& method : methods) {
    Scene scene = loaded_four_bar();  // closed loop: projection takes part in the dense output
    scene.simulation.end_time = 0.1;
    scene.simulation.integrator.type = method;
    if (method == "euler" || method == "rk2" || method == "rk4")
      scene.simulation.integrator.step = 0.004;
    else
      scene.simulation.integrator.rtol = 1e-5, scene.simulation.integrator.atol = 1e-7;
    const StepSequence steps = seen_at(scene, {}).steps;
    // Within three steps, never across their ends; not the first ones, which are tiny with CVODES.
    const std::size_t n = steps.times.size();
    std::vector<double> times;
    constexpr double h = 1e-6;
    for (const std::size_t step : {n / 3, n / 2, 3 * n / 4})
      for (const double theta : {0.21, 0.83})
        for (const double shift : {-h, 0.0, h}) times.push_back(steps.times[step] + theta * steps.sizes[step] + shift);
    const Seen seen = seen_at(scene, times);
    INFO(method);
    REQUIRE(seen.steps.sizes == steps.sizes);  // samples force no steps
    for (std::size_t i = 1; i < times.size(); i += 3) {
      const VectorXd difference = (seen.y[i + 1] - seen.y[i - 1]) / (2 * h);
      const double size = 1 + difference.cwiseAbs().maxCoeff();
      CHECK((seen.ydot[i] - difference).cwiseAbs().maxCoeff() < 1e-7 * size);
    }
  }
}
