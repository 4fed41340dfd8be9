// True extremes, their peaks one by one, and the gradients of these.
#include "optim/objective/peaks.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/simulate/simulation.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/expression_cost.hpp"
#include "optim/problem/parameter_values.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// x = a cos(w t), w = sqrt(k), on a spring, over 2.9 turns; extremes of x and of its rate.
Evaluator swinging(GradientMethod method, bool is_true = true) {
  Scene s = swinging_mass({{"a", 0.2}, {"k", 4}}, "-k*x", 2.9 * 3.14159265358979, 1e-11);
  s.sensors.push_back(point_sensor("v", "velocity", "mass", vec("0", "0", "0"), "x"));
  std::vector<Objective> objectives;
  const auto add = [&](const char* kind, const char* of) {
    ObjectiveSpec spec;
    spec.name = std::string(kind) + of;
    spec.mean(kind) = f(of);
    objectives.emplace_back(s, spec);
  };
  add("maximum_of", "v");
  add("minimum_of", "x + 0.01*t");  // the second valley is 0.03 above the first one
  add("peak_to_peak_of", "v");
  ObjectiveSpec integral;
  integral.name = "integral", integral.running = f("x^2");
  objectives.emplace_back(s, integral);
  EvaluatorOptions options;
  options.method = method;
  options.true_extremes = is_true;
  return Evaluator(std::move(s), std::move(objectives), {"a", "k"}, options);
}

}  // namespace

TEST_CASE("true extremes and their gradients are those of a cosine", "[peaks]") {
  Evaluator evaluator = swinging(GENERATE(GradientMethod::tlm, GradientMethod::adjoint));
  const double a = 0.2, w = 2;
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  CHECK(e.psi(0) == Approx(a * w).epsilon(1e-9));
  CHECK(e.psi_rho(0, 0) == Approx(w).epsilon(1e-7));
  CHECK(e.psi_rho(0, 1) == Approx(a / (2 * w)).epsilon(1e-6));
  CHECK(e.psi(2) == Approx(2 * a * w).epsilon(1e-9));
  CHECK(e.psi_rho(2, 0) == Approx(2 * w).epsilon(1e-7));
  // a cos(w t) + 0.01 t is stationary at sin(w t) = 0.01/(a w).
  const double phase = 3.14159265358979 - std::asin(0.01 / (a * w)), t = phase / w;
  CHECK(e.psi(1) == Approx(a * std::cos(phase) + 0.01 * t).epsilon(1e-9));
  CHECK(e.psi_rho(1, 0) == Approx(std::cos(phase)).epsilon(1e-6));
  CHECK(e.psi_rho(1, 1) == Approx(-a * t * std::sin(phase) / (2 * w)).epsilon(1e-4));
}

TEST_CASE("an extreme comes with its peaks, the most extreme one first", "[peaks]") {
  Evaluator evaluator = swinging(GradientMethod::tlm);
  const Evaluation e = evaluator.gradients(evaluator.start());
  std::vector<ExtremePiece> valleys;
  for (const ExtremePiece& piece : e.pieces)
    if (piece.row == 1) valleys.push_back(piece);
  REQUIRE(valleys.size() >= 3);  // one per turn
  CHECK(valleys[0].side == -1);
  CHECK(valleys[0].value == e.psi(1));
  CHECK(valleys[0].gradient.transpose() == e.psi_rho.row(1));
  const double turn = 3.14159265358979;  // of w = 2
  CHECK(valleys[1].t - valleys[0].t == Approx(turn).epsilon(1e-5));
  CHECK(valleys[1].value - valleys[0].value == Approx(0.01 * turn).epsilon(1e-6));
}

TEST_CASE("gradients of true extremes are the differences of free runs", "[peaks]") {
  Evaluator evaluator = swinging(GradientMethod::tlm);
  const Evaluation e = evaluator.gradients(evaluator.start());
  for (const Eigen::Index k : {0, 1}) {
    const Eigen::VectorXd h = 1e-4 * evaluator.start()(k) * Eigen::VectorXd::Unit(2, k);
    const Evaluation plus = evaluator.values(evaluator.start() + h), minus = evaluator.values(evaluator.start() - h);
    for (const Eigen::Index i : {0, 1, 2, 3})
      CHECK((plus.psi(i) - minus.psi(i)) / (2 * h(k)) == Approx(e.psi_rho(i, k)).epsilon(1e-5).margin(1e-6));
  }
}

// x = a cos(w t) passes x0 at full speed; x^2 has its highest peaks at both turns, of equal height, and one at the end.
TEST_CASE("peaks at kinks, at the ends of a run, and of every method are found within the run", "[peaks]") {
  const std::string method = GENERATE("dopri5", "dopri853", "cvodes_adams", "radau5");
  Scene s = swinging_mass({{"a", 0.2}, {"k", 4}}, "-k*x", 3.2, 1e-10);
  s.simulation.integrator.type = method;
  s.simulation.integrator.max_step.reset();
  CAPTURE(method);
  const Mechanism mechanism(s, parameter_values(s));
  const auto of = [&](const char* x) { return CostExpression(f(x), s).bind(mechanism); };
  PeakWatch watch({{-1, of("abs(x - 0.07)")}, {1, of("x^2")}, {1, of("t")}, {1, of("3")}, {1, of("log(-1 - x^2)")}},
                  s.simulation);
  REQUIRE(simulate(mechanism, s.simulation, {}, watch.sampling()).ok());
  const std::vector<std::vector<Peak>> found = watch.peaks();
  CHECK(std::abs(found[0].front().value) < 1e-6);  // 1e-5 of a bracket of a step
  CHECK(0.2 * std::cos(2 * found[0].front().t) == Approx(0.07).epsilon(1e-5));
  REQUIRE(found[1].size() == 3);  // t = 0, pi/2, pi
  for (const Peak& peak : found[1]) CHECK(peak.value == Approx(0.04).epsilon(1e-7));
  CHECK(found[2].size() == 1);
  CHECK(found[2].front().value == 3.2);
  CHECK(found[3].front().value == 3);
  CHECK(found[4].front().value == -INFINITY);  // nothing finite
}

TEST_CASE("other objectives do not change beside true extremes", "[peaks]") {
  Evaluator exact = swinging(GradientMethod::tlm), smooth = swinging(GradientMethod::tlm, false);
  const Evaluation a = exact.gradients(exact.start()), b = smooth.gradients(smooth.start());
  CHECK(a.psi(3) == Approx(b.psi(3)).epsilon(1e-12));
  CHECK((a.psi_rho.row(3) - b.psi_rho.row(3)).norm() < 1e-10);
  CHECK(b.pieces.empty());
  CHECK(b.psi(0) < a.psi(0));  // the smooth maximum is below
}

// The largest of min(2 (t - 0.4) + x, 0.9 - t) is where both are the same: 3 t = 1.7 - x(t), with x = a cos(w t). The
// instant follows the parameters: (3 - a w sin) dt = -cos da + a t sin dw.
TEST_CASE("the derivative of a peak at a kink follows the kink", "[peaks]") {
  const bool solved = GENERATE(true, false);
  const double a = 0.2, w = 2;
  Scene s;
  if (solved) {
    s = pushed_cart("0", 1.5, 1e-10);
    add_parameters(s, {{"a", a}, {"k", w * w}});
    Drive drive;
    drive.name = "motor", drive.type = "displacement", drive.joint = "slide", drive.law = f("a*cos(sqrt(k)*t)");
    s.forces.clear();
    s.drives.push_back(drive);
    s.sensors.push_back(point_sensor("x", "position", "cart", vec("0", "0", "0"), "x"));
  } else {
    s = swinging_mass({{"a", a}, {"k", w * w}}, "-k*x", 1.5, 1e-11);
  }
  ObjectiveSpec spec;
  spec.name = "peak", spec.mean("maximum_of") = f("min(2*(t - 0.4) + x, 0.9 - t)");
  std::vector<Objective> objectives;
  objectives.emplace_back(s, spec);
  EvaluatorOptions options;
  options.method = GENERATE(GradientMethod::tlm, GradientMethod::adjoint);
  options.true_extremes = true;
  Evaluator evaluator(std::move(s), std::move(objectives), {"a", "k"}, options);
  double t = 0.5;
  for (int i = 0; i < 20; ++i) t -= (3 * t - 1.7 + a * std::cos(w * t)) / (3 - a * w * std::sin(w * t));
  const double slope = 3 - a * w * std::sin(w * t);
  const Evaluation e = evaluator.gradients(evaluator.start());
  REQUIRE(e.ok);
  CHECK(e.psi(0) == Approx(0.9 - t).epsilon(1e-9));
  CHECK(e.psi_rho(0, 0) == Approx(std::cos(w * t) / slope).epsilon(1e-6));
  CHECK(e.psi_rho(0, 1) == Approx(-a * t * std::sin(w * t) / slope / (2 * w)).epsilon(1e-6));
}
