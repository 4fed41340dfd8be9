#include "optim/check/gradient_check.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/core/mechanism/moving_scenes.hpp"
#include "tests/optim/five_bar.hpp"

using namespace mbsopt;

namespace {

// A user's cost with a derivative that is wrong by some part of itself.
struct WrongCost : RunningCost {
  explicit WrongCost(double part) : wrong_(part) {}
  double g(double, VecIn y, VecIn) const override { return y(0) * y(0); }
  void add_g_y(double, VecIn y, VecIn, double scale, VecOut out) const override {
    out(0) += scale * 2 * y(0) * (1 + wrong_);
  }
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}

 private:
  double wrong_;
};

// x of the second body at the end, with a derivative that is wrong by some part of itself.
struct WrongEnd : TerminalCost {
  explicit WrongEnd(double part) : wrong_(part) {}
  double value(VecIn y, VecIn) const override { return y(7); }
  void adjoint_init(VecIn, VecIn, VecOut lambda, VecOut) const override { lambda(7) += 1 + wrong_; }

 private:
  double wrong_;
};

// Checks the five-bar with an objective of the parameters alone, one of which is p.
GradientCheck check_of_parameters(const std::string& objective) {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  testing::add_parameters(problem.scene, {{"p", 0.1 + 0.2}});  // 0.3 and its last place
  ObjectiveSpec sum;
  sum.name = "sum", sum.parameters_only = Expression::parse(objective);
  problem.objectives = {sum};
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  return check_gradients(problem, options);
}

}  // namespace

TEST_CASE("five-bar: every gradient method agrees with every other", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  ObjectiveSpec terminal;
  terminal.name = "drop";
  terminal.terminal = Expression::parse("r2_y");
  terminal.parameters_only = Expression::parse("0.01*k1*m1");
  terminal.samples = {{0.5, Expression::parse("r2_x*m2")}, {2.25, Expression::parse("t*r2_y^2")}};
  problem.objectives.push_back(terminal);
  problem.scene.simulation.end_time = 3;
  GradientCheckOptions options;
  options.timing.least_rounds = 3, options.timing.least_seconds = 0;
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  REQUIRE(check.entries.size() == 20);
  for (const CheckedEntry& e : check.entries) {
    INFO(e.objective << " " << e.parameter << ": tlm " << e.tlm << " adjoint " << e.adjoint << " frozen " << e.frozen
                     << " +- " << e.frozen_error << " free " << e.free);
    CHECK(e.exact == Verdict::agrees);
    CHECK(e.frozen_verdict == Verdict::agrees);
    CHECK(e.frozen_difference < 1e-7);
    REQUIRE(e.free_verdict);
    CHECK(passes(*e.free_verdict));
    CHECK(e.free_difference < 1e-3);
    CHECK(std::abs(e.free - e.tlm) <= std::max(1e-7 * std::abs(e.tlm), 10 * e.free_error));
  }
  for (const TaylorCheck& t : check.taylor) {
    INFO(t.objective << " slope " << t.slope.value_or(0));
    CHECK(t.passed);
    REQUIRE(t.slope);
    CHECK(*t.slope < 2.2);
  }
  for (const IdentityCheck& i : check.identities) {
    CHECK(i.relative_defect < 1e-11);
    CHECK(i.tlm == Approx(i.w.dot(check.tlm * i.d)).epsilon(1e-14));
  }
  CHECK(check.passed());
  CHECK(check.timing.adjoint.ratio > 0);
  CHECK(check.timing.tlm.ratio > 0);
  WARN("one simulation " << check.timing.simulation.wall_seconds << " s; tlm " << check.timing.tlm.ratio << ", adjoint "
                         << check.timing.adjoint.ratio << ", frozen differences " << check.frozen_cost.ratio);
}

TEST_CASE("entries that are zero, exactly or nearly, get a sane verdict", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 0.5;
  ObjectiveSpec x;
  x.name = "stiffness";  // of k1 alone: all other entries are exactly zero
  x.parameters_only = Expression::parse("k1^2");
  problem.objectives = {x};
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  for (const CheckedEntry& e : check.entries) {
    const bool zero = e.parameter != "k1";
    CHECK(e.exact == (zero ? Verdict::zero : Verdict::agrees));
    CHECK(e.frozen_verdict == (zero ? Verdict::zero : Verdict::agrees));
  }
  CHECK(check.passed());
}

TEST_CASE("a check whose base run fails says why and does not pass", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.integrator.max_steps = 3;
  const GradientCheck check = check_gradients(problem);
  CHECK_FALSE(check.ran);
  CHECK_FALSE(check.message.empty());
  CHECK_FALSE(check.passed());
}

TEST_CASE("free differences that their integration error excuses still judge: wrong by a hundredth is seen",
          "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 1;
  const Objective wrong("wrong", std::make_shared<WrongCost>(1e-2), nullptr);
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem.scene, {wrong}, options);
  REQUIRE(check.ran);
  const auto disagrees = [](const CheckedEntry& e) { return e.free_verdict == Verdict::disagrees; };
  CHECK(std::count_if(check.entries.begin(), check.entries.end(), disagrees) > 5);
}

// The delay of a signal moves the kinks at which steps end: its differences have steps of their own.
TEST_CASE("finer differences do not excuse a wrong derivative by the errors that their steps magnify", "[check]") {
  namespace t = mbsopt::testing;
  Scene scene;
  t::add_parameters(scene, {{"late", -0.113}});
  scene.gravity = {0.0, 0.0, 0.0};
  scene.bodies = {t::plain_body("cart", 1, {}, {0.1, 0.0, 0.0}), t::plain_body("trailer", 0.5, {}, {1.1, 0.0, 0.0})};
  for (const Body& b : scene.bodies) {
    Joint slide;
    slide.name = "slide_" + b.name, slide.type = "translational", slide.body1 = "ground", slide.body2 = b.name;
    slide.axis1 = slide.axis2 = t::vec("1", "0", "0");
    scene.joints.push_back(slide);
  }
  Tsda left, right;
  left.body2 = "cart", left.point1 = t::vec("-1", "0.5", "0");
  left.stiffness = 200.0, left.damping = 2.0, left.free_length = 0.9;
  right.body1 = "cart", right.body2 = "trailer", right.stiffness = 600.0, right.damping = 1.0, right.free_length = 0.9;
  scene.forces = {{"left", left}, {"right", right}};
  std::vector<double> times, push;
  for (int i = 0; i <= 40; ++i)
    times.push_back(0.05 * i), push.push_back(20 * std::sin(0.15 * i) + 0.5 * (i * 7919 % 13));
  Signal u;
  u.name = "u", u.interpolation = Interpolation::linear, u.delay = t::f("late");
  u.curve = std::make_shared<const Curve>(Interpolation::linear, times, push);
  scene.signals = {u};
  PointForce motor;
  motor.body = "trailer", motor.components = {t::f("u"), t::f("0"), t::f("0")};
  scene.forces.push_back({"motor", motor});
  scene.simulation.end_time = 1.8;
  scene.simulation.integrator.type = "radau5";
  scene.simulation.integrator.rtol = 1e-6, scene.simulation.integrator.atol = 1e-8;
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.continuous = false;
  for (const double part : {0.0, 1e-1, 1e-2, -1e-2}) {
    const Objective objective("x", nullptr, std::make_shared<WrongEnd>(part));
    const GradientCheck check = check_gradients(scene, {objective}, options);
    INFO(check.message);
    REQUIRE(check.ran);
    const CheckedEntry& late = check.entries.back();
    INFO(part << ' ' << late.tlm << ' ' << late.free << " +- " << late.free_error);
    CHECK(passes(*late.free_verdict) == (part == 0));
  }
}

TEST_CASE("differences that cannot be evaluated have failed, they are not zero", "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.simulation.end_time = 0.2;
  ObjectiveSpec root;
  root.name = "root";  // of a number that is 0 here, and negative on one side
  root.parameters_only = Expression::parse("sqrt(m1 - m4 + 1e-300) + k1");
  problem.objectives = {root};
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  CHECK_FALSE(check.passed());
  for (const CheckedEntry& e : check.entries) {
    if (e.parameter != "m1" && e.parameter != "m4") continue;
    CHECK(e.frozen_verdict == Verdict::failed);
    CHECK(e.free_verdict == Verdict::failed);
    CHECK(std::isnan(e.frozen));
    CHECK(to_string(e.frozen_verdict.value()) == "FAILED");
  }
  const auto says_why = [](const std::string& w) {
    return w.find("differences in 'm1' could not be evaluated: the objective 'root'") == 0;
  };
  CHECK(std::any_of(check.warnings.begin(), check.warnings.end(), says_why));
}

TEST_CASE("the Taylor remainder of a linear objective has no slope, and that is right", "[check]") {
  const GradientCheck check = check_of_parameters("L01 + 2*k1 + m1 + m2 - c1");
  REQUIRE(check.taylor.size() == 1);
  CHECK_FALSE(check.taylor[0].slope);
  CHECK(check.taylor[0].passed);
  CHECK(check.passed());
}

TEST_CASE("a kink is named with the slopes at its two sides", "[check]") {
  const GradientCheck check = check_of_parameters("5*p + 2*sqrt((p - 0.3)^2)");
  REQUIRE(check.ran);
  CHECK_FALSE(check.passed());
  REQUIRE(check.warnings.size() == 1);
  CHECK_THAT(check.warnings[0],
             Catch::StartsWith("sum is not smooth in p: its slope is 3 below the value and 7 above it"));
}

TEST_CASE("a wrong derivative of a user's cost shows in frozen differences, not in TLM against adjoint", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 1;
  const Objective wrong("wrong", std::make_shared<WrongCost>(1e-5), nullptr);
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.free_steps = false;
  const GradientCheck check = check_gradients(problem.scene, {wrong}, options);
  REQUIRE(check.ran);
  CHECK_FALSE(check.passed());
  int disagree = 0;
  for (const CheckedEntry& e : check.entries) {
    CHECK(e.exact == Verdict::agrees);
    disagree += e.frozen_verdict == Verdict::disagrees;
  }
  CHECK(disagree > 5);
}

TEST_CASE("derivatives that are 0 but for rounding do not disagree", "[check]") {
  // A bar that turns about z in space: inertias about x and y have no part in it.
  Problem problem;
  Scene& s = problem.scene;
  testing::add_parameters(s, {{"jx", 0.7}, {"jy", 0.8}});
  s.gravity = {0.0, -9.81, 0.0};
  s.bodies.push_back(testing::body("bar", {0.7, 0.0, 0.0}, {0.0, 0.0, 0.0}, testing::turned("0.3")));
  s.bodies[0].inertia = {testing::f("jx"), testing::f("jy"), 1.1, 0.1, 0.2, 0.15};
  s.joints.push_back(testing::hinge("A", "ground", testing::vec("0", "0", "0"), "bar", testing::vec("0", "0", "0")));
  s.sensors.push_back(testing::angle_sensor("theta", "A"));
  s.simulation.model = ModelChoice::spatial;
  ObjectiveSpec swing;
  swing.name = "swing", swing.running = Expression::parse("(theta + 1)^2");
  problem.objectives = {swing};
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.continuous = false;
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  REQUIRE(check.entries.size() == 2);
  bool apart = false;
  for (const CheckedEntry& e : check.entries) {
    INFO(e.parameter << ": tlm " << e.tlm << ", adjoint " << e.adjoint << ", frozen " << e.frozen << " +- "
                     << e.frozen_error << ", free " << e.free << " +- " << e.free_error);
    CHECK(std::abs(e.tlm) < 1e-13);
    apart = apart || e.tlm_adjoint > 1e-10;  // of themselves
    CHECK(passes(e.exact));
    CHECK(passes(e.frozen_verdict.value()));
  }
  CHECK(apart);
  CHECK(check.passed());
}

TEST_CASE("an objective that is 0 but for rounding does not disagree, with CVODES neither", "[check]") {
  // A bar that turns about a tilted axis: its other rates are rounding.
  Problem problem;
  Scene& s = problem.scene;
  testing::add_parameters(s, {{"c", 0.7}, {"m", 1.3}});
  s.gravity = {0.3, -9.81, 0.2};
  s.bodies.push_back(testing::body("bar", testing::vec("c", "0.1", "0.2"), {0.0, 0.0, 0.0}, testing::turned("0.3")));
  s.bodies[0].mass = testing::f("m");
  s.bodies[0].inertia = {0.7, 0.8, 1.1, 0.1, 0.2, 0.15};
  Joint hinge = testing::hinge("A", "ground", testing::vec("0", "0", "0"), "bar", testing::vec("0", "0", "0"));
  hinge.axis1 = hinge.axis2 = testing::vec("0.3", "0.4", "1");
  s.joints.push_back(hinge);
  for (const char* axis : {"x", "y"}) {
    Sensor rate;
    rate.name = std::string("w") + axis, rate.quantity = "angular_velocity", rate.body = "bar", rate.component = axis;
    s.sensors.push_back(rate);
  }
  s.simulation.end_time = 0.5;
  ObjectiveSpec nothing;
  nothing.name = "nothing", nothing.running = Expression::parse("sin(wx - 0.75*wy)");  // the axis in ground: 3 to 4
  problem.objectives = {nothing};
  GradientCheckOptions options;
  options.timing = {1, 1, 0};
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  CHECK(std::abs(check.psi(0)) < 1e-13);
  CHECK(check.psi(0) != 0);
  REQUIRE(check.continuous);
  CHECK(check.continuous->worst_verdict("nothing") != Verdict::disagrees);
  for (const TaylorCheck& taylor : check.taylor) CHECK(taylor.passed);
  CHECK(check.passed());
}

TEST_CASE("rounding by Cholesky at a large penalty is named as what methods differ by", "[check]") {
  Problem problem = five_bar::problem(1e-8);
  problem.scene.simulation.end_time = 0.5;
  problem.scene.simulation.formulation = FormulationSettings::penalty();
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.continuous = false;
  const GradientCheck by_cholesky = check_gradients(problem, options);
  REQUIRE(by_cholesky.ran);
  CHECK(by_cholesky.passed());
  const auto names_it = [](const std::string& w) {
    return w.find("by cholesky rounds derivatives") != std::string::npos &&
           w.find("quasidefinite") != std::string::npos;
  };
  CHECK(std::any_of(by_cholesky.warnings.begin(), by_cholesky.warnings.end(), names_it));
  problem.scene.simulation.formulation.linear_solver = LinearSolver::quasidefinite;
  const GradientCheck quasidefinite = check_gradients(problem, options);
  CHECK(quasidefinite.passed());
  CHECK(std::none_of(quasidefinite.warnings.begin(), quasidefinite.warnings.end(), names_it));
}

// Penalty lets joints give way across the plane, so that their redundant equations are independent by 1/alpha.
TEST_CASE("tangent and adjoint agree where a load presses a redundant loop of soft joints out of its plane",
          "[check]") {
  Problem problem = five_bar::problem(1e-6);
  problem.scene.gravity = {1.0, -9.81, 4.0};
  SimulationSettings& simulation = problem.scene.simulation;
  simulation.end_time = 0.5;
  simulation.model = ModelChoice::spatial;
  simulation.formulation = FormulationSettings::penalty();
  simulation.formulation.linear_solver = LinearSolver::quasidefinite, simulation.formulation.alpha = 1e9;
  GradientCheckOptions options;
  options.timing = {1, 1, 0}, options.continuous = false;
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  for (const CheckedEntry& e : check.entries) {
    INFO(e.parameter << ": tlm " << e.tlm << ", adjoint " << e.adjoint);
    CHECK(e.tlm_adjoint < 2e-14);
  }
}
