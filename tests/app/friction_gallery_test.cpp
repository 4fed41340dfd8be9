// Friction and drives that expressions describe, against their own equations in minimal coordinates.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/json/read_problem.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "optim/problem/parameter_values.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The classical method of order 4 for y' = f(t, y), from y = 0.
template <std::size_t N, class Function>
std::array<double, N> integrated(const Function& f, double end, int steps) {
  using State = std::array<double, N>;
  State y{};
  const double h = end / steps;
  const auto moved = [&](const State& k, double part) {
    State to = y;
    for (std::size_t i = 0; i < N; ++i) to[i] += part * h * k[i];
    return to;
  };
  for (int n = 0; n < steps; ++n) {
    const double t = n * h;
    const State k1 = f(t, y), k2 = f(t + h / 2, moved(k1, 0.5)), k3 = f(t + h / 2, moved(k2, 0.5)),
                k4 = f(t + h, moved(k3, 1));
    for (std::size_t i = 0; i < N; ++i) y[i] += h / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
  }
  return y;
}

// x [m], v [m/s], z [m]: Canudas de Wit, Olsson, Astrom and Lischinsky (1995), equations 2 to 4, at the file's numbers;
// |v| as in the file.
std::array<double, 3> lugre(double t, const std::array<double, 3>& y) {
  const auto [x, v, z] = y;
  const double level = 1 + 0.5 * std::exp(-v * v / 1e-4);
  const double zdot = v - 1e4 * std::hypot(v, 1e-5) * z / level;
  return {v, 2 * (0.1 * t - x) - (1e4 * z + 100 * zdot + 0.4 * v), zdot};
}

// theta, theta', q, q' of wheel and arm: the equations of problems/friction/geared_drive.json.
std::array<double, 4> geared_drive(double t, const std::array<double, 4>& y) {
  const auto [theta, speed, q, rate] = y;
  const auto above_zero = [](double x) { return (x + std::hypot(x, 2e-3)) / 2; };
  const double d = q - theta, load = 50 * (above_zero(d - 0.01) - above_zero(-d - 0.01)) + 0.02 * (rate - speed);
  const double friction = 0.2 * std::hypot(load, 1e-3) * std::tanh(speed / 0.05) + 0.01 * speed;
  return {speed, (20 * 0.015 * std::sin(5 * t) + load - friction) / (1e-3 + 400 * 1e-5), rate,
          (-load - 0.5 * 9.81 * 0.1 * std::sin(q)) / (1e-3 + 0.5 * 0.1 * 0.1)};
}

}  // namespace

TEST_CASE("a block sticks and slips as LuGre's three equations say", "[gallery][force]") {
  const Problem problem = read_problem(file_of("friction/stick_slip"));
  const Scene& scene = problem.scene;
  const Mechanism mechanism(scene, parameter_values(scene));
  // It sticks for 7.5 s, slips, and sticks again.
  const std::vector<double> times{5, 9, 10, 12};
  std::size_t reached = 0;
  const Sampling sampling{times, [&](std::size_t i, const StatePoint& at) {
                            ++reached;
                            const std::array<double, 3> y = integrated<3>(lugre, times[i], 200000);
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

TEST_CASE("a geared drive: reflected inertia, play and friction by the load are those of two equations",
          "[gallery][force]") {
  const Problem problem = read_problem(file_of("friction/geared_drive"));
  const Scene& scene = problem.scene;
  const Mechanism mechanism(scene, parameter_values(scene));
  const std::vector<double> times{0.1, 0.5, 1, 1.5};
  double play = 0;
  const Sampling sampling{times, [&](std::size_t i, const StatePoint& at) {
                            const std::array<double, 4> y = integrated<4>(geared_drive, times[i], 40000);
                            INFO("at " << times[i] << " s");
                            CHECK(mechanism.sensor_value(mechanism.sensor("theta"), at) == Approx(y[0]).margin(1e-7));
                            CHECK(mechanism.sensor_value(mechanism.sensor("q"), at) == Approx(y[2]).margin(1e-7));
                            play = std::max(play, std::abs(y[2] - y[0]));
                          }};
  const SimulationResult result = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(result.message);
  REQUIRE(result.ok());
  CHECK(play > 0.01);  // the teeth carry load
}
