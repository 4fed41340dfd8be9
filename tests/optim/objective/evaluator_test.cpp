#include "optim/objective/evaluator.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>

#include "core/force/user_force.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/check/gradient_check.hpp"
#include "optim/objective/objective_run.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;
using Catch::Contains;
using testing::f;
using testing::vec;

namespace {

// g = max(0, rho_10 - 1) y_0, and how often its gradient is computed.
struct ClippedCost final : RunningCost {
  double g(double, VecIn y, VecIn rho) const override { return std::max(0.0, rho(10) - 1) * y(0); }
  void add_g_y(double, VecIn, VecIn rho, double scale, VecOut out) const override {
    ++gradients, out(0) += scale * std::max(0.0, rho(10) - 1);
  }
  void add_g_rho(double, VecIn y, VecIn rho, double scale, VecOut out) const override {
    if (rho(10) > 1) out(10) += scale * y(0);
  }
  mutable std::size_t gradients = 0;
};

// g = rho_k y_0, with k = -1: y_0.
struct FirstCoordinate final : RunningCost {
  explicit FirstCoordinate(Eigen::Index parameter) : k(parameter) {}
  double g(double, VecIn y, VecIn rho) const override { return y(0) * (k < 0 ? 1 : rho(k)); }
  void add_g_y(double, VecIn, VecIn rho, double scale, VecOut out) const override {
    out(0) += scale * (k < 0 ? 1 : rho(k));
  }
  void add_g_rho(double, VecIn y, VecIn, double scale, VecOut out) const override {
    if (k >= 0) out(k) += scale * y(0);
  }
  Eigen::Index k;
};

Problem with_idle_parameter() {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  testing::add_parameters(problem.scene, {{"idle", 2.0}});
  return problem;
}

}  // namespace

TEST_CASE("drift of CVODES within its tolerance is no contradiction of joints", "[gradient][cvodes]") {
  const Problem problem = five_bar::problem(1e-8);
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::cvodes_forward, GradientMethod::cvodes_adjoint);
  Evaluator evaluator(problem.scene, objectives_of(problem), {"k1"}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  CHECK(e.warnings == std::vector<std::string>());
}

TEST_CASE("a parameter that nothing uses is an error in C++, too", "[gradient]") {
  Problem problem = with_idle_parameter();
  CHECK_THROWS_WITH(Evaluator(problem.scene, objectives_of(problem)),
                    Contains("parameters.idle: 'idle' is used by nothing") && Contains("allow_unused"));
  CHECK_THROWS_WITH(check_gradients(problem), Contains("'idle' is used by nothing"));
  CHECK_NOTHROW(Evaluator(problem.scene, objectives_of(problem), {"k1", "m1"}));  // it is no variable
  problem.scene.parameters.back().allow_unused = true;
  CHECK_NOTHROW(Evaluator(problem.scene, objectives_of(problem)));
}

TEST_CASE("a parameter that only a cost in C++ may use fails where its derivatives are all 0", "[gradient]") {
  const Problem problem = with_idle_parameter();
  Evaluator unused(problem.scene, {Objective("x", std::make_shared<FirstCoordinate>(-1), nullptr)});
  const Evaluation& e = unused.gradients(unused.start());
  CHECK_FALSE(e.ok);
  CHECK_THAT(e.message, Contains("parameters.idle") && Contains("all exactly 0"));
  Evaluator used(problem.scene, {Objective("x", std::make_shared<FirstCoordinate>(10), nullptr)});
  CHECK(used.gradients(used.start()).ok);
}

TEST_CASE("a search may come where the derivatives in a variable of C++ costs are all 0", "[gradient]") {
  const Problem problem = with_idle_parameter();
  Evaluator evaluator(problem.scene, {Objective("x", std::make_shared<ClippedCost>(), nullptr)});
  Eigen::VectorXd rho = evaluator.start();
  CHECK(evaluator.gradients(rho).ok);
  rho(10) = 0.5;  // clipped
  const Evaluation& e = evaluator.gradients(rho);
  CHECK(e.ok);
  REQUIRE(e.warnings.size() == 1);
  CHECK_THAT(e.warnings[0], Contains("parameters.idle: its derivatives are all exactly 0"));
  Evaluator from_there(problem.scene, {Objective("x", std::make_shared<ClippedCost>(), nullptr)});
  CHECK_FALSE(from_there.gradients(rho).ok);
}

TEST_CASE("once the user has stopped, an evaluation begins no simulation, not even its assembly", "[gradient]") {
  const Problem problem = five_bar::problem();
  EvaluatorOptions options;
  options.progress = [](double) { return false; };
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  const Evaluation& e = evaluator.gradients(evaluator.start());
  CHECK_FALSE(e.ok);
  CHECK(e.simulations == 0);
  CHECK_THAT(e.message, Contains("stopped"));
}

TEST_CASE("parameters that are no numbers fail in words", "[gradient]") {
  const Problem problem = five_bar::problem();
  Evaluator evaluator(problem.scene, objectives_of(problem));
  Eigen::VectorXd rho = evaluator.start();
  rho(0) = std::numeric_limits<double>::quiet_NaN();
  const Evaluation& e = evaluator.values(rho);
  CHECK_FALSE(e.ok);
  CHECK_THAT(e.message, Contains("is no finite number"));
}

TEST_CASE("the gradient of a running cost is computed once at each stage", "[gradient]") {
  const Problem problem = with_idle_parameter();
  const auto cost = std::make_shared<ClippedCost>();
  const GradientMethod method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint);
  Evaluator evaluator(problem.scene, {Objective("x", cost, nullptr)}, {}, {method, {}, {}, {}});
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  const Method& rk = *runge_kutta_method(problem.scene.simulation.integrator.type);
  const long nodes = rk.stages - std::count(rk.b, rk.b + rk.stages, 0.0);
  CHECK(cost->gradients == e.steps.sizes.size() * static_cast<std::size_t>(nodes));
  CHECK(e.psi(0) == evaluator.values_on(e.steps, e.rho).psi(0));
}

TEST_CASE("an objective in C++ without any cost is refused", "[objective]") {
  CHECK_THROWS_WITH(Objective("nothing", nullptr, nullptr), Contains("objective 'nothing': has neither"));
}

TEST_CASE("an evaluation warns of a running cost that jumps with the motion, by the objective's name", "[gradient]") {
  Problem problem = five_bar::problem(1e-6);
  problem.objectives[0].running = Expression::parse("abs(r2_y + 2.05)/(r2_y + 2.05)");  // the point falls from -2
  Evaluator follows(problem.scene, objectives_of(problem));
  CHECK(follows.gradients(follows.start()).warnings.empty());
  problem.scene.simulation.follows_kinks = false;
  Evaluator evaluator(problem.scene, objectives_of(problem));
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  REQUIRE(e.warnings.size() >= 1);
  CHECK_THAT(e.warnings.back(), Contains("the integrand of objective '" + problem.objectives[0].name + "' jumps by 2"));
}

TEST_CASE("a jump of a small running cost counts beside a large one", "[gradient]") {
  Problem problem = five_bar::problem(1e-6);
  problem.objectives[0].running = Expression::parse("1e-6*abs(r2_y + 2.05)/(r2_y + 2.05)");
  Evaluator alone(problem.scene, objectives_of(problem));
  const Eigen::VectorXd expected = alone.gradients(alone.start()).psi_rho.row(0);
  REQUIRE(expected.norm() > 1e-9);
  problem.objectives.push_back(problem.objectives[0]);
  problem.objectives[1].name = "large", problem.objectives[1].running = Expression::parse("1e9*(r2_y + 3)");
  Evaluator both(problem.scene, objectives_of(problem));
  const Eigen::VectorXd found = both.gradients(both.start()).psi_rho.row(0);
  CHECK((found - expected).norm() < 1e-6 * expected.norm());
}

TEST_CASE("the gradient of a maximum is resolved although the motion rests after a short blow", "[gradient]") {
  Scene scene;  // 14 N m for 20 ms turn the wheel at 0.28/J = 0.4 rad/s from 1 s on
  testing::add_parameters(scene, {{"J", 0.7}});
  scene.gravity = {0.0, 0.0, 0.0};
  scene.bodies.push_back(testing::plain_body("wheel", 1, {f("J"), f("J"), f("J"), 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.joints.push_back(testing::hinge("hub", "ground", vec("0", "0", "0"), "wheel", vec("0", "0", "0")));
  Signal blow;
  blow.name = "blow", blow.interpolation = Interpolation::hold;
  const std::vector<double> t{0, 1, 1.02, 12}, moment{0, 14, 0, 0};
  blow.curve = std::make_shared<const Curve>(Interpolation::hold, t, moment);
  scene.signals = {blow};
  scene.forces.push_back({"hit", Torque{"wheel", {f("0"), f("0"), f("blow")}}});
  Sensor rate;
  rate.name = "rate", rate.quantity = "rate", rate.joint = "hub";
  scene.sensors.push_back(rate);
  scene.simulation.end_time = 12;
  ObjectiveSpec fastest;
  fastest.name = "fastest", fastest.means[0] = f("rate");
  Evaluator evaluator(scene, {Objective(scene, fastest)});
  const Evaluation& e = evaluator.gradients(evaluator.start());
  INFO(e.message);
  REQUIRE(e.ok);
  CHECK(e.psi_rho(0, 0) == Approx(-0.4 / 0.7).epsilon(2e-3));
  CHECK(e.warnings == std::vector<std::string>());
}

TEST_CASE("a peak that a solved run passes over is said", "[gradient]") {
  Scene scene;
  testing::add_parameters(scene, {{"A", 0.4}});
  scene.gravity = {0.0, 0.0, 0.0};
  scene.bodies.push_back(testing::plain_body("wheel", 1, {1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.joints.push_back(testing::hinge("hub", "ground", vec("0", "0", "0"), "wheel", vec("0", "0", "0")));
  scene.sensors.push_back(testing::angle_sensor("angle", "hub"));
  scene.drives = {{"motor", "angle", "", "", "hub", "ground", "", "O", "O", f("A*sin(3*t)"), {}}};
  scene.simulation.end_time = 3;
  ObjectiveSpec peak;
  peak.name = "peak";
  const auto said = [&](double width) {
    peak.means[0] = f("exp(-((angle - 0.23)/" + Expression(width).text() + ")^2)");
    Evaluator evaluator(scene, {Objective(scene, peak)});
    const Evaluation e = evaluator.values(evaluator.start());
    REQUIRE(e.ok);
    return missed_peaks(evaluator.objectives(), e.psi, evaluator.true_values(evaluator.start()));
  };
  CHECK(said(0.1).empty());
  const std::vector<std::string> narrow = said(3e-4);
  REQUIRE(narrow.size() == 1);
  CHECK_THAT(narrow[0], Contains("'peak'") && Contains("the true extreme is 1") && Contains("max_step"));
  Evaluator evaluator(scene, {Objective(scene, peak)});
  for (const std::string& warning : evaluator.gradients(evaluator.start()).warnings)
    CHECK_THAT(warning, !Contains("jumps"));
}

TEST_CASE("the derivative of a root through zero is watched, though the root itself is resolved", "[gradient]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 2;
  problem.objectives[0].running = Expression::parse("sqrt(abs(r2_y + 2.05))");
  const GradientMethod method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint);
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, {method, {}, {}, {}});
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  CHECK(e.statistics.gradient_quadrature.error > 0.03);
  REQUIRE(e.warnings.size() == 1);
  CHECK_THAT(e.warnings[0], Contains("do not resolve the derivative of the integrand of objective"));
  problem.objectives[0].running = Expression::parse("(r2_y + 2.05)^2");
  Evaluator smooth(problem.scene, objectives_of(problem));
  CHECK(smooth.gradients(smooth.start()).warnings.empty());
}
