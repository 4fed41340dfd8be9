// Friction with a state of its own, written as expressions (problems/friction/stick_slip.json).
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/json/read_problem.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

using State = std::array<double, 3>;  // x [m], v [m/s], z [m]

// Canudas de Wit, Olsson, Astrom and Lischinsky (1995), equations 2 to 4, at the file's numbers; |v| as in the file.
State lugre(double t, const State& y) {
  const auto [x, v, z] = y;
  const double level = 1 + 0.5 * std::exp(-v * v / 1e-4);
  const double zdot = v - 1e4 * std::hypot(v, 1e-5) * z / level;
  return {v, 2 * (0.1 * t - x) - (1e4 * z + 100 * zdot + 0.4 * v), zdot};
}

// The classical method of order 4.
State integrated(double end, int steps) {
  State y{};
  const double h = end / steps;
  const auto moved = [&](const State& k, double part) {
    return State{y[0] + part * h * k[0], y[1] + part * h * k[1], y[2] + part * h * k[2]};
  };
  for (int n = 0; n < steps; ++n) {
    const double t = n * h;
    const State k1 = lugre(t, y), k2 = lugre(t + h / 2, moved(k1, 0.5)), k3 = lugre(t + h / 2, moved(k2, 0.5)),
                k4 = lugre(t + h, moved(k3, 1));
    for (std::size_t i = 0; i < 3; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return y;
}

}  // namespace

TEST_CASE("a block sticks and slips as LuGre's three equations say", "[gallery][force]") {
  const Problem problem = read_problem(file_of("friction/stick_slip"));
  const Scene& scene = problem.scene;
  Eigen::VectorXd rho(static_cast<Eigen::Index>(scene.parameters.size()));
  for (std::size_t k = 0; k < scene.parameters.size(); ++k)
    rho(static_cast<Eigen::Index>(k)) = scene.parameters[k].value;
  const Mechanism mechanism(scene, rho);
  // It sticks for 7.5 s, slips, and sticks again.
  const std::vector<double> times{5, 9, 10, 12};
  std::size_t reached = 0;
  const Sampling sampling{times, [&](std::size_t i, const StatePoint& at) {
                            ++reached;
                            const State y = integrated(times[i], 200000);
                            INFO("at " << times[i] << " s");
                            CHECK(mechanism.sensor_value(mechanism.sensor("x"), at) == Approx(y[0]).margin(1e-6));
                            CHECK(mechanism.sensor_value(mechanism.sensor("v"), at) == Approx(y[1]).margin(1e-5));
                            CHECK(mechanism.sensor_value(mechanism.sensor("z"), at) == Approx(y[2]).margin(1e-8));
                          }};
  const SimulationResult result = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(reached == times.size());
}
