// Objectives that are no sums: smooth extremes and root mean squares over time, and the true extremes beside them.
#include "optim/objective/objective.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "optim/check/gradient_check.hpp"
#include "optim/objective/evaluator.hpp"
#include "optim/objective/objective_run.hpp"
#include "tests/core/mechanism/one_coordinate.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// A mass on a spring of stiffness k, moving as x = a cos(w t), w = sqrt(k) = 2 with the nominal parameters; over 5 s.
Scene oscillator() {
  Scene s = swinging_mass({{"k", 4.0}, {"a", 0.3}}, "-k*x", 5);
  s.simulation.integrator.max_step = 0.02;
  return s;
}

Problem problem_with(ObjectiveSpec spec) {
  Problem problem;
  problem.scene = oscillator();
  spec.name = "psi";
  problem.objectives = {std::move(spec)};
  return problem;
}
ObjectiveSpec maximum(const std::string& of, double sharpness) {
  ObjectiveSpec spec;
  spec.mean("maximum_of") = f(of), spec.sharpness = sharpness;
  return spec;
}

Evaluation evaluated(const Problem& problem, GradientMethod method) {
  EvaluatorOptions options;
  options.method = method;
  Evaluator evaluator(problem.scene, objectives_of(problem), {}, options);
  return evaluator.gradients(evaluator.start());
}
std::optional<double> true_value(const Problem& problem) {
  const Evaluator evaluator(problem.scene, objectives_of(problem));
  return evaluator.true_values(evaluator.start())[0];
}

// (1/k) log of the mean over time of exp(k x(t)), by the trapezoidal rule on very many points.
double smooth_maximum(double sharpness, double offset) {
  constexpr int n = 400000;
  double sum = 0;
  for (int i = 0; i <= n; ++i) {
    const double x = offset + 0.3 * std::cos(2 * 5.0 * i / n);
    sum += (i == 0 || i == n ? 0.5 : 1) * std::exp(sharpness * (x - offset - 0.3));
  }
  return offset + 0.3 + std::log(sum / n) / sharpness;
}

}  // namespace

TEST_CASE("a smooth maximum is the exponential mean, below the true one, which is reported", "[objective]") {
  const double sharpness = GENERATE(1.0, 30.0, 300.0);
  const Problem problem = problem_with(maximum("x", sharpness));
  const Evaluation e = evaluated(problem, GradientMethod::automatic);
  REQUIRE(e.ok);
  CHECK(e.psi(0) == Approx(smooth_maximum(sharpness, 0)).epsilon(1e-8));
  REQUIRE(true_value(problem));
  CHECK(e.psi(0) < *true_value(problem));
  CHECK(*true_value(problem) == Approx(0.3).epsilon(1e-8));
}

TEST_CASE("an extreme without a sharpness is smooth enough for its size", "[objective]") {
  Problem problem = problem_with(maximum("-1e6*x", 1));
  problem.objectives[0].sharpness.reset();
  problem.scene.simulation.integrator.max_step.reset();
  // Two peaks of 3e5 = x and the curvature 4 x, at k = 100/x: below x by log(T/2 sqrt(k 4 x/(2 pi)))/k.
  const double smooth = 3e5 - 3e3 * std::log(2.5 * std::sqrt(400 / (2 * 3.14159265358979)));
  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    const Evaluation e = evaluated(problem, method);
    INFO(e.message);
    REQUIRE(e.ok);
    CHECK(e.psi(0) == Approx(smooth).epsilon(2e-3));
    CHECK(e.psi_rho(0, 1) == Approx(1e6 * (1 - 1 / 200.)).epsilon(1e-3));  // in a, at this k
  }
  CHECK(*true_value(problem) == Approx(3e5).epsilon(1e-8));
}

TEST_CASE("a smooth maximum far from zero does not leave the range of numbers", "[objective]") {
  // exp(30 * 400) is infinite, exp(-30 * 400) is zero
  const std::string offset = GENERATE(as<std::string>{}, "400", "-400");
  const Problem near = problem_with(maximum("x", 30)), far = problem_with(maximum("x + " + offset, 30));
  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    const Evaluation a = evaluated(near, method), b = evaluated(far, method);
    INFO(b.message);
    REQUIRE((a.ok && b.ok));
    CHECK(b.psi(0) - std::stod(offset) == Approx(a.psi(0)).epsilon(1e-10));
    CHECK((a.psi_rho - b.psi_rho).norm() < 1e-9 * a.psi_rho.norm());
  }
}

TEST_CASE("a minimum is minus the maximum of minus its expression", "[objective]") {
  ObjectiveSpec spec;
  spec.mean("minimum_of") = f("x"), spec.sharpness = 40;
  const Problem lowest = problem_with(spec), highest = problem_with(maximum("-x", 40));
  const Evaluation a = evaluated(lowest, GradientMethod::adjoint), b = evaluated(highest, GradientMethod::adjoint);
  CHECK(a.psi(0) == Approx(-b.psi(0)).epsilon(1e-13));
  CHECK((a.psi_rho + b.psi_rho).norm() < 1e-12 * a.psi_rho.norm());
  CHECK(*true_value(lowest) == Approx(-*true_value(highest)));
  CHECK(*true_value(lowest) < a.psi(0));
}

TEST_CASE("a peak to peak value is the maximum less the minimum, smooth and true", "[objective]") {
  ObjectiveSpec both, least;
  both.mean("peak_to_peak_of") = least.mean("minimum_of") = f("x^2 - x + 300");
  both.sharpness = least.sharpness = 40;
  const Problem width = problem_with(both), lowest = problem_with(least),
                highest = problem_with(maximum("x^2 - x + 300", 40));
  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    const Evaluation w = evaluated(width, method), a = evaluated(highest, method), b = evaluated(lowest, method);
    REQUIRE(w.ok);
    CHECK(w.psi(0) == Approx(a.psi(0) - b.psi(0)).epsilon(1e-11));  // 300 has the rounding 1e-13
    CHECK((w.psi_rho - a.psi_rho + b.psi_rho).norm() < 1e-9 * w.psi_rho.norm());
  }
  // x from -0.3 to 0.3: x^2 - x from -0.21 to 0.39
  CHECK(*true_value(width) == Approx(0.6).epsilon(1e-8));
}

TEST_CASE("an rms is the root of the mean square over time", "[objective]") {
  ObjectiveSpec spec;
  spec.mean("rms_of") = f("x + 0.1");
  const Problem problem = problem_with(spec);
  const Evaluation e = evaluated(problem, GradientMethod::tlm);
  // mean over T of (a cos w t + b)^2
  const double T = 5, w = 2, a = 0.3, b = 0.1;
  const double mean = a * a * (0.5 + std::sin(2 * w * T) / (4 * w * T)) + 2 * a * b * std::sin(w * T) / (w * T) + b * b;
  CHECK(e.psi(0) == Approx(std::sqrt(mean)).epsilon(1e-8));
  CHECK_FALSE(true_value(problem));
  // d/da by hand
  const double slope = (a * (0.5 + std::sin(2 * w * T) / (4 * w * T)) + b * std::sin(w * T) / (w * T)) / e.psi(0);
  CHECK(e.psi_rho(0, 1) == Approx(slope).epsilon(1e-7));
}

TEST_CASE("an rms of nothing is zero, with a gradient that is a number", "[objective]") {
  ObjectiveSpec spec;
  spec.mean("rms_of") = f("0*x");
  Problem problem = problem_with(spec);
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  const Evaluation constant = evaluated(problem, GradientMethod::tlm);
  CHECK(constant.psi(0) == 0);
  spec.mean("rms_of") = f("x - x");
  const Evaluation e = evaluated(problem_with(spec), GradientMethod::adjoint);
  CHECK(e.psi(0) == 0);
  CHECK(e.psi_rho.norm() == 0);
}

TEST_CASE("an rms of rounding, whose squares sum to less than zero, is zero", "[objective]") {
  ObjectiveSpec spec;
  spec.mean("rms_of") = f("x");
  const Problem problem = problem_with(spec);
  const Objective objective(problem.scene, problem.objectives[0]);
  const auto [psi, slope, curvature] = objective.of_integral(-1e-33);
  CHECK(psi == 0);
  CHECK(slope == 0);
}

TEST_CASE("the gradients of all kinds agree with each other and with differences", "[objective]") {
  Problem problem;
  problem.scene = every_force_four_bar();
  problem.scene.simulation.end_time = 0.2;
  ObjectiveSpec peak = maximum("v + 0.1*drag", 8), low, rms, width, tension = maximum("pull_of_spring", 0.5);
  peak.name = "peak", low.name = "low", rms.name = "rms", width.name = "width", tension.name = "tension";
  width.mean("peak_to_peak_of") = f("z*drag"), width.sharpness = 20;
  low.mean("minimum_of") = f("z*angle"), low.sharpness = 50;
  rms.mean("rms_of") = f("vz");
  problem.objectives = {peak, low, rms, width, tension};
  for (Parameter& p : problem.scene.parameters) p.allow_unused = true;
  GradientCheckOptions options;
  options.free_steps = false;
  const GradientCheck check = check_gradients(problem, options);
  REQUIRE(check.ran);
  for (const CheckedEntry& entry : check.entries) {
    INFO(entry.objective << ", " << entry.parameter << ": " << entry.tlm << ", " << entry.adjoint << ", "
                         << entry.frozen);
    CHECK(entry.exact != Verdict::disagrees);
    CHECK(entry.frozen_verdict != Verdict::disagrees);
  }
  CHECK(check.passed());
}

TEST_CASE("an objective that stands alone is refused beside other parts", "[objective]") {
  ObjectiveSpec spec = maximum("x", 10);
  spec.name = "mixed", spec.terminal = f("x");
  CHECK_THROWS_WITH(Objective(oscillator(), spec),
                    Catch::Contains("objectives.mixed.maximum_of: must be the only part"));
}

TEST_CASE("a true extreme is a value that is reached, also of what the steps do not resolve", "[objective]") {
  Problem problem = problem_with(maximum("sin(k*300*t + 40*x)", 20));
  IntegratorSettings& integrator = problem.scene.simulation.integrator;
  integrator.type = "radau5", integrator.rtol = 1e-6;  // whose weights are positive, so that there is a number at all
  integrator.max_step.reset();
  const Evaluation e = evaluated(problem, GradientMethod::adjoint);
  INFO(e.message);
  REQUIRE(e.ok);
  REQUIRE(true_value(problem));
  CHECK(*true_value(problem) <= 1);
  CHECK(e.statistics.extreme_quadrature.error > 0.03);
  const auto says_peaks = [](const std::string& w) { return w.find("do not resolve the peaks") != std::string::npos; };
  CHECK(std::any_of(e.warnings.begin(), e.warnings.end(), says_peaks));
  const Evaluation resolved = evaluated(problem_with(maximum("x", 30)), GradientMethod::adjoint);
  CHECK(resolved.warnings.empty());
}

// x = 0.5 sin(2 pi t) passes 0.2 twice within 7 ms; the sharpness hides the peak from the smooth maximum.
TEST_CASE("a true extreme of a solved run is found in a narrow peak, and no row of the trajectory exceeds it",
          "[objective]") {
  const auto [of, exact] = GENERATE(table<const char*, double>({{"x + 3*exp(-((x - 0.2)/0.02)^2)", 3.200033333},
                                                                {"3*exp(-((t - 0.6137)/1e-4)^2)", 3.0},
                                                                {"cos(2*pi*t)*x/x", 0.99950656}}));
  Problem problem = problem_with(maximum(of, 0.5));
  Scene& scene = problem.scene;
  scene = pushed_cart("0", 1, 1e-9);
  scene.sensors.push_back(point_sensor("x", "position", "cart", vec("0", "0", "0"), "x"));
  Drive drive;
  drive.name = "drive", drive.type = "displacement", drive.joint = "slide", drive.law = f("0.5*sin(2*pi*t)");
  scene.drives.push_back(drive);
  scene.simulation.output_step = 0.005;
  REQUIRE(true_value(problem));
  CHECK(*true_value(problem) >= exact - 1e-8);
  CHECK(*true_value(problem) < exact + 5e-4);
}

TEST_CASE("the search of a true extreme stops when it is asked to", "[objective]") {
  const Problem problem = problem_with(maximum("x", 30));
  const std::vector<Objective> objectives = objectives_of(problem);
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  const SimulationSettings& settings = problem.scene.simulation;
  const StepSequence steps = simulate(mechanism, settings).steps;
  int looks = 0;
  const auto stop = [&](double) { return ++looks < 3; };
  CHECK_FALSE(true_extremes(objectives, mechanism, settings, steps, stop)[0]);
  CHECK(looks == 3);
}
