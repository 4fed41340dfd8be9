// Running costs with kinks in solved runs: panels end at the kinks, which derivatives follow.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "optim/objective/expression_cost.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

constexpr double kPathEnd = 5;

// A ram at x = a sin(w t).
Scene ram() {
  Scene s;
  add_parameters(s, {{"a", 0.2}, {"w", 3.0}});
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("ram", 2, {1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  Joint guide;
  guide.name = "guide", guide.type = "translational", guide.body2 = "ram";
  guide.axis1 = vec("1", "0", "0"), guide.axis2 = vec("1", "0", "0");
  s.joints.push_back(guide);
  Drive push;
  push.name = "push", push.type = "displacement", push.joint = "guide", push.law = f("a*sin(w*t)");
  s.drives.push_back(push);
  s.sensors.push_back(point_sensor("v", "velocity", "ram", vec("0", "0", "0"), "x"));
  s.simulation.end_time = kPathEnd;
  return s;
}

SimulationResult path_length(const Scene& s, const VectorXd& rho, bool backward) {
  const Mechanism m(s, rho);
  std::vector<Cost> costs(1);
  costs[0].name = "path", costs[0].running = CostExpression(f("abs(v)"), s).bind(m);
  return backward ? simulate_adjoint(m, s.simulation, costs) : simulate_tlm(m, s.simulation, costs);
}

}  // namespace

// The path turns at w t = pi/2, 3 pi/2, ..., five times before w t = 15, and is a (9 + 1 - sin(15)) long.
TEST_CASE("a solved run integrates a path that turns, and its gradient, on few panels", "[driven]") {
  const Scene s = ram();
  const VectorXd rho = nominal(s);
  const bool backward = GENERATE(true, false);
  const SimulationResult run = path_length(s, rho, backward);
  REQUIRE(run.ok());
  const double length = 9 + 1 - std::sin(15.0), slope = -0.2 * kPathEnd * std::cos(15.0);
  CHECK(run.psi(0) == Approx(0.2 * length).epsilon(1e-11));
  CHECK(run.psi_rho(0, 0) == Approx(length).epsilon(1e-11));
  CHECK(run.psi_rho(0, 1) == Approx(slope).epsilon(1e-10));
  CHECK(run.statistics.steps < 30);
  CHECK(run.statistics.rejected < 15);
  const double h = 1e-4;
  const VectorXd w = h * VectorXd::Unit(2, 1);
  const double difference =
      (path_length(s, rho + w, backward).psi(0) - path_length(s, rho - w, backward).psi(0)) / (2 * h);
  CHECK(difference == Approx(slope).epsilon(1e-6));
}
