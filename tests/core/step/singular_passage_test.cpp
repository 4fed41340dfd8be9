#include "core/step/singular_passage.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// The response of a mechanism whose singular value is d(t) = t* - t, beside constraints that stay well.
Eigen::VectorXd response(double t_star, double t) { return Eigen::Vector2d(std::pow(t_star - t, -3), 1); }

struct Passed {
  double theta, size;
};

// The step that passes t*, of steps of size h from 0 but for what the passage asks for.
Passed step_past(SingularPassage& passage, double t_star, double h, double most) {
  passage.forget();
  double t = 0;
  for (int k = 0; k < 1000; ++k) {
    double now = passage.propose(t, h, most);
    for (int tries = 0; !passage.well_placed(t, now, h, most, response(t_star, t + now)) && tries < 3; ++tries) {
      now = passage.propose(t, h, most);
    }
    passage.accept();
    if (t + now > t_star) return {(t_star - t) / now, now};
    t += now;
  }
  FAIL("t* was never passed");
  return {};
}

}  // namespace

TEST_CASE("wherever a singular position lies, a step passes it where its method magnifies least", "[singular]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "verner6", "dopri853", "bs3", "rk2");
  SingularPassage passage(*runge_kutta_method(method), 2);
  const double most = GENERATE(1.0, 0.1);  // steps may be limited, too
  for (double t_star = 1; t_star < 1.1; t_star += 0.003) {
    const auto [theta, size] = step_past(passage, t_star, 0.1, most);
    INFO(method << ", t* = " << t_star << ", steps of at most " << most << ": at theta = " << theta << " of " << size
                << ", best " << passage.best_theta());
    CHECK(passage.magnified(theta) < 5 * passage.magnified(passage.best_theta()));
    CHECK(size > 0.039);
    CHECK(size <= std::min(most, 0.111));
  }
}

TEST_CASE("wherever a singular position is ahead, no step is proposed that is much longer than accuracy asks for",
          "[singular]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "verner6", "dopri853", "bs3", "rk2");
  SingularPassage passage(*runge_kutta_method(method), 2);
  // Known from a try that ended beyond t* = 1.
  passage.forget();
  for (const double t : {0.5, 0.7}) {
    passage.well_placed(t, 0.2, 0.2, 1, response(1, t + 0.2));
    passage.accept();
  }
  for (double h = 0.01; h < 0.4; h *= 1.01) {
    const double size = passage.propose(0.9, h, 1);
    INFO(method << ": " << size << " instead of " << h);
    CHECK((size > 0.099 * h && size < 1.101 * h));
    if (size < 0.99 * h && size > 0.11 * h) CHECK(std::abs(0.1 / size - 1) > 0.1);  // not to end at t*
  }
}

TEST_CASE("no step is changed where the constraints stay well", "[singular]") {
  SingularPassage passage(*runge_kutta_method("dopri853"), 2);
  for (int k = 0; k < 100; ++k) {
    const double t = 0.1 * k, angle = std::sin(t);
    CHECK(passage.propose(t, 0.1, 1) == 0.1);
    CHECK(!passage.near(t, 0.1));
    CHECK(passage.well_placed(t, 0.1, 0.1, 1, Eigen::Vector2d(2 + angle, -1 + 3 * angle)));
    passage.accept();
  }
}

// Ten passages. Without a regard for them dopri853 takes eight times the right-hand sides at 1e-10 that it takes at
// 1e-9, and no digit more comes of it.
TEST_CASE("A02: tighter tolerances cost little more and give more digits through singular positions", "[singular]") {
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "verner6", "dopri853");
  const ModelChoice model = GENERATE(ModelChoice::planar, ModelChoice::spatial);
  Scene scene = n_four_bar(2);
  scene.simulation.model = model;
  scene.simulation.integrator.type = method;
  const Mechanism mechanism(scene, Eigen::VectorXd());
  const Eigen::VectorXd angles;
  double before = 0;
  for (const double rtol : {1e-8, 1e-9, 1e-10, 1e-11}) {
    scene.simulation.integrator.rtol = rtol, scene.simulation.integrator.atol = 0.01 * rtol;
    const SimulationResult run = simulate(mechanism, scene.simulation);
    REQUIRE(run.ok());
    const StatePoint end{10, run.y_end, angles};
    const double error = std::hypot(mechanism.sensor_value(0, end) - 0.3284581115408154,
                                    mechanism.sensor_value(1, end) - 0.944518538178601);
    const double work = static_cast<double>(run.statistics.rhs_evaluations);
    INFO(method << " at " << rtol << ": " << work << " right-hand sides, error " << error);
    CHECK(error < 500 * rtol);
    if (before > 0) CHECK(work < 1.8 * before);
    before = work;
  }
}
