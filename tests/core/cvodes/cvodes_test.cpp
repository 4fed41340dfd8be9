// CVODES: its motions against references, its derivatives (of the differential equation) against the discrete ones of
// the Runge-Kutta runs at tight tolerances, and what it says when it cannot go on.
#include "core/cvodes/cvodes.hpp"

#include <malloc.h>

#include <catch2/catch.hpp>
#include <limits>

#include "core/cvodes/cvodes_linear_solver.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Matchers::Contains;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::shared_ptr<const PointCost> product(const Mechanism& m, const std::string& a, const std::string& b) {
  return std::make_shared<SensorProduct>(m, m.sensor(a), m.sensor(b));
}

SimulationSettings by(const std::string& type, double rtol, SimulationSettings s) {
  s.integrator.type = type;
  s.integrator.rtol = rtol, s.integrator.atol = 0.01 * rtol;
  return s;
}

// The discrete run to compare with. Its steps follow the state alone, so that a running cost with a sharper bend than
// the motion needs shorter ones.
SimulationSettings discrete(SimulationSettings s) {
  s = by("dopri853", 1e-11, s);
  s.integrator.max_step = 0.01 * s.end_time;
  return s;
}

// A scene, and costs of every kind on two of its sensors.
struct CvodesCase {
  std::string name;
  Scene scene;
  std::string a, b;

  std::vector<Cost> costs(const Mechanism& m) const {
    const double end = scene.simulation.end_time;
    std::vector<Cost> list(3);
    list[0].running = product(m, a, a);
    list[1].running = product(m, a, b);
    list[1].terminal = product(m, b, b);
    list[1].samples = {{0, product(m, a, b)},
                       {0.31 * end, product(m, b, b)},
                       {0.31 * end, product(m, a, a)},
                       {0.3105 * end, product(m, a, b)},
                       {end, product(m, a, a)}};
    list[2].samples = {{0.77 * end, product(m, a, b)}};
    return list;
  }
};

CvodesCase double_pendulum_case() {
  CvodesCase c{"double pendulum", double_pendulum(), "theta1", "tip"};
  c.scene.gravity = {0.0, -9.81, 0.0};
  c.scene.sensors.push_back(point_sensor("tip", "position", "lower", vec("L1", "0", "0"), "y"));
  c.scene.conditions = {value_of("theta1", "theta0")};
  c.scene.simulation.end_time = 1.5;
  return c;
}

CvodesCase four_bar_case() {
  CvodesCase c{"four-bar", four_bar(), "theta", "x"};
  c.scene.gravity = {0.0, -9.81, 0.0};
  c.scene.sensors.push_back(point_sensor("x", "position", "coupler", vec("L2/2", "0.1", "0"), "x"));
  c.scene.conditions = {value_of("theta", "theta0"), rate_of("theta", "rate0")};
  c.scene.simulation.end_time = 1;
  return c;
}

CvodesCase every_force_case() {
  CvodesCase c{"every force", every_force_four_bar(), "angle", "z"};
  c.scene.simulation.end_time = 0.5;
  return c;
}

CvodesCase acceleration_case() {
  CvodesCase c = double_pendulum_case();
  c.name = "accelerations", c.b = "a";
  c.scene.sensors.push_back(point_sensor("a", "acceleration", "lower", vec("L1", "0", "0"), "x"));
  c.scene.simulation.end_time = 0.5;
  return c;
}

void check_close(const CvodesCase& c, const MatrixXd& found, const MatrixXd& expected, double tolerance) {
  for (Eigen::Index o = 0; o < expected.rows(); ++o) {
    const double size = expected.row(o).cwiseAbs().maxCoeff();
    for (Eigen::Index k = 0; k < expected.cols(); ++k) {
      INFO("objective " << o << ", " << c.scene.parameters[static_cast<std::size_t>(k)].name);
      CHECK(std::abs(found(o, k) - expected(o, k)) <= tolerance * std::max(std::abs(expected(o, k)), 1e-3 * size));
    }
  }
}

// A rod on a spring and damper so stiff that a mode dies out within 0.1 ms.
Scene stiff_pendulum() {
  Scene s = pendulum();
  s.gravity = {0.0, -9.81, 0.0};
  add_parameters(s, {{"k", 8e5}, {"damping", 4e4}});
  Rsda r;
  r.joint = "A", r.stiffness = f("k"), r.damping = f("damping"), r.free_angle = 0.3;
  s.forces.push_back({"spring", r});
  s.conditions = {value_of("theta", "theta0"), rate_of("theta", "rate0")};
  s.simulation.end_time = 2;
  return s;
}

}  // namespace

TEST_CASE("A01 by CVODES: the simple pendulum is right at 10 s", "[cvodes]") {
  const Scene scene = point_pendulum();
  const auto [method, tolerance] = GENERATE(table<std::string, double>({{"cvodes_adams", 1e-7}, {"cvodes_bdf", 1e-6}}));
  const SimulationResult run = simulate(Mechanism(scene, VectorXd()), by(method, 1e-11, scene.simulation));
  INFO(method << ": " << run.message);
  REQUIRE(run.ok());
  CHECK(std::abs(run.y_end(0) + 0.2750874625761169) < tolerance);
  CHECK(std::abs(run.y_end(1) + 0.9614192050991251) < tolerance);
  CHECK(std::abs(run.y_end(7) - 4.175598100951729) < 4 * tolerance);
  // Not projected, and still on the circle to the tolerance.
  CHECK(run.statistics.max_position_violation < tolerance);
  CHECK(run.statistics.max_position_violation > 0);
  CHECK(run.statistics.energy_drift < 10 * tolerance);
  CHECK(run.statistics.steps == static_cast<long>(run.steps.times.size()));
  CHECK(run.statistics.rhs_evaluations > run.statistics.steps);
  CHECK(run.steps.times.back() + run.steps.sizes.back() == 10);
}

TEST_CASE("forward and adjoint sensitivities of CVODES are the discrete ones to 1e-6", "[cvodes][gradient]") {
  const CvodesCase c =
      GENERATE(values<CvodesCase>({double_pendulum_case(), four_bar_case(), every_force_case(), acceleration_case()}));
  const std::string method = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  const Mechanism m(c.scene, nominal(c.scene));
  const std::vector<Cost> costs = c.costs(m);
  const SimulationResult exact = simulate_tlm(m, discrete(c.scene.simulation), costs);
  const SimulationSettings settings = by(method, 1e-10, c.scene.simulation);
  const SimulationResult plain = simulate(m, settings, costs);
  const SimulationResult forward = simulate_tlm(m, settings, costs);
  const SimulationResult adjoint = simulate_adjoint(m, settings, costs);
  INFO(c.name << ", " << method << ": " << exact.message << plain.message << forward.message << adjoint.message);
  REQUIRE((exact.ok() && plain.ok() && forward.ok() && adjoint.ok()));
  const double size = exact.psi.cwiseAbs().maxCoeff();
  CHECK((plain.psi - exact.psi).cwiseAbs().maxCoeff() < 1e-6 * size);
  CHECK((forward.psi - exact.psi).cwiseAbs().maxCoeff() < 1e-6 * size);
  CHECK(adjoint.psi == plain.psi);
  check_close(c, forward.psi_rho, exact.psi_rho, 1e-6);
  check_close(c, adjoint.psi_rho, exact.psi_rho, 1e-6);
}

TEST_CASE("CVODES differentiates the penalty form and stabilised constraints, and drifts less with these",
          "[cvodes][gradient]") {
  CvodesCase c = four_bar_case();
  const Mechanism m(c.scene, nominal(c.scene));
  const std::vector<Cost> costs = c.costs(m);
  const auto drift = [&](const FormulationSettings& formulation) {
    SimulationSettings settings = by("cvodes_adams", 1e-7, c.scene.simulation);
    settings.formulation = formulation;
    settings.end_time = 10;
    const SimulationResult run = simulate(m, settings);
    REQUIRE(run.ok());
    return run.statistics.max_position_violation;
  };
  FormulationSettings formulation;
  SECTION("penalty") {
    formulation = FormulationSettings::penalty();
    formulation.alpha = 1e4;
  }
  SECTION("stabilised") {
    formulation.omega = 5;
    CHECK(drift(formulation) < 0.5 * drift({}));
  }
  formulation.projection = Projection::none;
  c.scene.simulation.formulation = formulation;
  const SimulationResult exact = simulate_tlm(m, discrete(c.scene.simulation), costs);
  const SimulationSettings settings = by("cvodes_adams", 1e-10, c.scene.simulation);
  const SimulationResult forward = simulate_tlm(m, settings, costs), adjoint = simulate_adjoint(m, settings, costs);
  INFO(exact.message << forward.message << adjoint.message);
  REQUIRE((exact.ok() && forward.ok() && adjoint.ok()));
  check_close(c, forward.psi_rho, exact.psi_rho, 1e-6);
  check_close(c, adjoint.psi_rho, exact.psi_rho, 1e-6);
}

TEST_CASE("sensitivities of CVODES do not depend on what memory held before", "[cvodes][gradient]") {
  const CvodesCase c = double_pendulum_case();
  const Mechanism m(c.scene, nominal(c.scene));
  const SimulationSettings settings = by("cvodes_adams", 1e-9, c.scene.simulation);
  MatrixXd first;
  for (const int byte : {0, 1, 0x80, 0xff}) {  // where it is not 0 memory is filled with it, or its complement
    mallopt(M_PERTURB, byte);
    const SimulationResult run = simulate_tlm(m, settings, c.costs(m));
    mallopt(M_PERTURB, 0);
    REQUIRE(run.ok());
    if (first.size() == 0) first = run.psi_rho;
    INFO("memory filled with " << byte);
    CHECK(run.psi_rho == first);
  }
}

TEST_CASE("states sampled from CVODES carry their sensitivities", "[cvodes][gradient]") {
  const CvodesCase c = four_bar_case();
  const std::string method = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  const Mechanism m(c.scene, nominal(c.scene));
  const std::vector<double> times{0.0, 0.123, 0.124, 0.7, 1.0};
  const auto sampled = [&](const SimulationSettings& settings) {
    std::vector<MatrixXd> y_rho;
    TangentSampling sampling;
    sampling.times = times;
    sampling.observe = [&](std::size_t, const StatePoint&, const MatrixXd& d) { y_rho.push_back(d); };
    REQUIRE(simulate_tlm(m, settings, {}, sampling).ok());
    return y_rho;
  };
  const std::vector<MatrixXd> exact = sampled(discrete(c.scene.simulation)),
                              found = sampled(by(method, 1e-10, c.scene.simulation));
  REQUIRE(found.size() == times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    INFO("t = " << times[i]);
    CHECK((found[i] - exact[i]).cwiseAbs().maxCoeff() < 1e-6 * exact[i].cwiseAbs().maxCoeff());
  }
}

TEST_CASE("states sampled from CVODES carry their rate, with and without sensitivities", "[cvodes]") {
  const CvodesCase c = four_bar_case();
  const VectorXd rho = nominal(c.scene);
  const std::vector<bool> none(static_cast<std::size_t>(rho.size()), false);
  for (const Mechanism& m : {Mechanism(c.scene, rho), Mechanism(c.scene, rho, none)}) {
    const auto rate = [&](const SimulationSettings& settings) {
      VectorXd found;
      TangentSampling sampling{{0.7}, [&](std::size_t, const StatePoint& at, const MatrixXd&) {
                                 REQUIRE(at.ydot);
                                 found = *at.ydot;
                               }};
      REQUIRE(simulate_tlm(m, settings, {}, sampling).ok());
      return found;
    };
    const VectorXd exact = rate(discrete(c.scene.simulation)),
                   found = rate(by("cvodes_bdf", 1e-10, c.scene.simulation));
    CHECK((found - exact).norm() < 1e-5 * exact.norm());
  }
}

TEST_CASE("observers see the samples of CVODES in order, at their times", "[cvodes]") {
  const CvodesCase c = double_pendulum_case();
  const Mechanism m(c.scene, nominal(c.scene));
  std::vector<double> seen, steps;
  Sampling sampling{{0, 0.2, 0.2, 1.5}, [&](std::size_t, const StatePoint& at) { seen.push_back(at.t); }};
  RunOptions options;
  options.after_step = [&](const StatePoint& at) { steps.push_back(at.t); };
  const SimulationResult run = simulate(m, by("cvodes_adams", 1e-6, c.scene.simulation), {}, sampling, options);
  REQUIRE(run.ok());
  CHECK(seen == sampling.times);
  CHECK(steps.back() == 1.5);
  CHECK(steps.size() == run.steps.times.size());
}

TEST_CASE("the matrix of CVODES' Newton iteration solves I - gamma f_y, and its transpose", "[cvodes]") {
  const CvodesCase c = every_force_case();
  const Mechanism m(c.scene, nominal(c.scene));
  const SimulationResult run = simulate(m, c.scene.simulation);
  REQUIRE(run.ok());
  const VectorXd angles = VectorXd::Constant(static_cast<Eigen::Index>(m.data().angles.size()), 0.7);
  cvodes::Flow flow(m, c.scene.simulation.formulation);
  flow.start(0, angles);
  VectorXd y = run.y_end;
  const Eigen::Index n = y.size();
  const auto f = [&](VectorXd at) {
    REQUIRE(flow.evaluate(0.3, cvodes::Flow::Numbers(at.data(), n)));
    return flow.ydot();
  };
  MatrixXd f_y(n, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const VectorXd e = VectorXd::Unit(n, k) * 1e-4;
    f_y.col(k) = (8 * (f(y + e) - f(y - e)) - (f(y + 2 * e) - f(y - 2 * e))) / 12e-4;
  }
  ShiftedSystem matrix(m.data(), flow.dynamics());
  REQUIRE(flow.linearise(0.3, cvodes::Flow::Numbers(y.data(), n)));
  matrix.linearise(0.3, y, flow.angles_at(0.3), flow.ydot().tail(n / 2), flow.dynamics().lambda());
  const double gamma = GENERATE(0.02, -0.3);
  REQUIRE(matrix.factor(gamma));
  const MatrixXd A = MatrixXd::Identity(n, n) - gamma * f_y;
  VectorXd b(n);
  for (Eigen::Index k = 0; k < n; ++k) b(k) = std::sin(static_cast<double>(k) + 1);
  VectorXd x = b;
  matrix.solve(x, 1);
  CHECK((A * x - b).cwiseAbs().maxCoeff() < 1e-7 * A.cwiseAbs().maxCoeff() * x.cwiseAbs().maxCoeff());
  x = b;
  matrix.solve_transposed(x, 1);
  CHECK((A.transpose() * x - b).cwiseAbs().maxCoeff() < 1e-7 * A.cwiseAbs().maxCoeff() * x.cwiseAbs().maxCoeff());
}

TEST_CASE("cvodes_bdf takes long steps where a stiff mode has died out, and its gradients hold", "[cvodes][stiff]") {
  const Scene scene = stiff_pendulum();
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = product(m, "theta", "theta");
  costs[0].terminal = product(m, "theta", "theta");
  const SimulationResult bdf = simulate(m, by("cvodes_bdf", 1e-7, scene.simulation), costs),
                         rk = simulate(m, by("dopri5", 1e-7, scene.simulation), costs);
  REQUIRE((bdf.ok() && rk.ok()));
  CHECK(20 * bdf.statistics.rhs_evaluations < rk.statistics.rhs_evaluations);
  CHECK(bdf.psi(0) == Approx(rk.psi(0)).epsilon(1e-6));
  // An explicit method's derivatives, too, are stable only below its limit: 6 over the fast mode's 5e4 1/s.
  SimulationSettings settings = by("cvodes_bdf", 1e-11, scene.simulation), small_steps;
  settings.end_time = 0.2;
  small_steps = by("dopri853", 1e-10, settings);
  small_steps.integrator.max_step = 5e-5;
  const SimulationResult forward = simulate_tlm(m, settings, costs), adjoint = simulate_adjoint(m, settings, costs),
                         exact = simulate_tlm(m, small_steps, costs);
  INFO(forward.message << adjoint.message);
  REQUIRE((forward.ok() && adjoint.ok() && exact.ok()));
  const CvodesCase c{"stiff", scene, "", ""};
  check_close(c, forward.psi_rho, exact.psi_rho, 1e-6);
  check_close(c, adjoint.psi_rho, exact.psi_rho, 1e-6);
}

TEST_CASE("the adjoint of CVODES comes back through checkpoints, and angles over turns", "[cvodes][gradient]") {
  Scene scene = pendulum();
  scene.conditions = {value_of("theta", "theta0"), rate_of("theta", "9*rate0")};
  scene.gravity = {0.0, -9.81, 0.0};
  scene.simulation.end_time = 3;
  const Mechanism m(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = product(m, "theta", "theta");
  SimulationSettings few = by("cvodes_adams", 1e-10, scene.simulation), many = few;
  many.integrator.max_step = 1e-4;  // 30 000 steps, more than are kept between checkpoints
  const SimulationResult exact = simulate_tlm(m, discrete(scene.simulation), costs);
  const SimulationResult whole = simulate_adjoint(m, few, costs), pieces = simulate_adjoint(m, many, costs);
  INFO(whole.message << pieces.message);
  REQUIRE((exact.ok() && whole.ok() && pieces.ok()));
  CHECK(pieces.statistics.steps > 25'000);
  CHECK(exact.psi(0) > 100);  // several turns
  const CvodesCase c{"turns", scene, "", ""};
  check_close(c, whole.psi_rho, exact.psi_rho, 1e-6);
  check_close(c, pieces.psi_rho, exact.psi_rho, 1e-6);
  CHECK(whole.statistics.adjoint_memory_bytes > 0);
}

TEST_CASE("an objective that leaves the range of numbers ends as one, at the end of the motion", "[cvodes]") {
  struct Explosion final : PointCost {
    double value(const StatePoint& at) const override { return std::exp(3000 * at.t); }
    double add_gradient(const StatePoint& at, double, VecOut, VecOut) const override { return value(at); }
  };
  const Scene scene = point_pendulum();
  const Mechanism m(scene, VectorXd());
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<Explosion>();
  const SimulationSettings settings = by("cvodes_adams", 1e-6, scene.simulation);
  for (const SimulationResult& run :
       {simulate(m, settings, costs), simulate_tlm(m, settings, costs), simulate_adjoint(m, settings, costs)}) {
    CHECK(run.status == SimulationStatus::not_finite);
    CHECK(run.last_good_time == 10);
    CHECK_THAT(run.message, Contains("objective is not finite"));
  }
}

TEST_CASE("what CVODES cannot do is said in words", "[cvodes]") {
  Scene scene = pendulum();
  scene.gravity = {0.0, -9.81, 0.0};
  scene.simulation.end_time = 2;
  const std::string method = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  SimulationSettings settings = by(method, 1e-8, scene.simulation);
  const auto run = [&] { return simulate(Mechanism(scene, nominal(scene)), settings); };

  SECTION("too many steps") {
    settings.integrator.max_steps = 30;
    const SimulationResult r = run();
    CHECK(r.status == SimulationStatus::too_many_steps);
    CHECK_THAT(r.message, Contains("more than 30 steps") && Contains("max_steps"));
    CHECK(r.last_good_time < 2);
    CHECK(r.y_end.allFinite());
  }
  SECTION("a law that ends") {
    Rsda r;
    r.joint = "A", r.law = f("sqrt(1 - t)*rate");
    scene.forces.push_back({"until", r});
    for (const SimulationResult& end : {run(), simulate_tlm(Mechanism(scene, nominal(scene)), settings)}) {
      CHECK(!end.ok());
      CHECK(end.last_good_time == Approx(1).epsilon(1e-3));
      CHECK(end.last_good_time <= 1);
      CHECK_THAT(end.message, Contains("t = "));
    }
  }
  SECTION("a law that is not finite at the start") {
    Rsda r;
    r.joint = "A", r.law = f("1/t");
    scene.forces.push_back({"never", r});
    const SimulationResult end = run();
    CHECK(end.status == SimulationStatus::not_finite);
    CHECK(end.last_good_time == 0);
    CHECK_THAT(end.message, Contains("at the start"));
  }
  SECTION("tolerances beyond the numbers' digits") {
    settings.integrator.rtol = 1e-18, settings.integrator.atol = 1e-20;
    CHECK_THAT(run().message, Contains("loosen"));
  }
  SECTION("an assembly that fails") {
    scene.conditions = {value_of("theta", "theta0"), value_of("theta", "a")};
    const SimulationResult end = run();
    CHECK(end.status == SimulationStatus::assembly_failed);
    CHECK(!end.message.empty());
  }
  SECTION("steps of another run, and a fixed step") {
    const Mechanism m(scene, nominal(scene));
    const StepSequence steps{{0}, {2}};
    CHECK_THROWS_WITH(simulate(m, settings, {}, {}, {&steps, {}}), Contains("cannot repeat the steps"));
    settings.integrator.step = 0.1;
    CHECK_THROWS_WITH(simulate_adjoint(m, settings, {}), Contains("chooses its own steps"));
    CHECK_FALSE(with_cvodes(settings).integrator.step);
  }
}

TEST_CASE("a run of CVODES can be stopped, forward and on the way back", "[cvodes]") {
  const CvodesCase c = double_pendulum_case();
  const Mechanism m(c.scene, nominal(c.scene));
  const std::vector<Cost> costs = c.costs(m);
  const SimulationSettings settings = by("cvodes_adams", 1e-8, c.scene.simulation);
  int calls = 0;
  RunOptions early{nullptr, [&](double) { return ++calls < 5; }};
  const SimulationResult forward = simulate_adjoint(m, settings, costs, early);
  CHECK(forward.status == SimulationStatus::stopped);
  CHECK(forward.statistics.steps == 5);
  int at_end = 0;
  RunOptions late{nullptr, [&](double t) { return t < 1.5 || ++at_end < 3; }};
  const SimulationResult back = simulate_adjoint(m, settings, costs, late);
  CHECK(back.status == SimulationStatus::stopped);
  CHECK_THAT(back.message, Contains("in the backward run"));
}

TEST_CASE("with_cvodes keeps what a file asks for", "[cvodes]") {
  SimulationSettings s;
  s.integrator.rtol = 1e-5;
  CHECK(with_cvodes(s).integrator.type == "cvodes_adams");
  CHECK(with_cvodes(s).integrator.rtol == 1e-5);
  s.integrator.type = "cvodes_bdf";
  CHECK(with_cvodes(s).integrator.type == "cvodes_bdf");
}

TEST_CASE("what a user's cost throws comes through CVODES as it was thrown", "[cvodes]") {
  struct Broken final : PointCost {
    double value(const StatePoint& at) const override {
      if (at.t > 0.05) throw std::out_of_range("beyond the table");
      return 0;
    }
    double add_gradient(const StatePoint& at, double, VecOut, VecOut) const override { return value(at); }
  };
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.2;
  scene.simulation.integrator.type = GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf");
  const Mechanism mechanism(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<Broken>();
  CHECK_THROWS_AS(simulate(mechanism, scene.simulation, costs), std::out_of_range);
  CHECK_THROWS_AS(simulate_tlm(mechanism, scene.simulation, costs), std::out_of_range);
  CHECK_THROWS_AS(simulate_adjoint(mechanism, scene.simulation, costs), std::out_of_range);
}

// A bar turns by itself for 1 s, meets a stop for some 10 ms, and turns back by itself for 5 s.
TEST_CASE("the adjoint of CVODES does not step over a stop that the forward run met", "[cvodes][gradient]") {
  Scene s = pendulum();
  add_parameters(s, {{"w", 0.5}});
  s.gravity = {0.0, 0.0, 0.0};
  Rsda stop;
  stop.joint = "A", stop.law = f("1e6*max(0, angle - 0.5)^2");
  s.forces = {{"stop", stop}};
  s.conditions = {value_of("theta", "0"), rate_of("theta", "w")};
  s.simulation.end_time = 6;
  const SimulationSettings settings = by(GENERATE(as<std::string>{}, "cvodes_adams", "cvodes_bdf"), 1e-9, s.simulation);
  const Mechanism m(s, nominal(s));
  Cost cost;
  cost.terminal = product(m, "theta", "theta");
  const SimulationResult forward = simulate_tlm(m, settings, {&cost, 1});
  const SimulationResult adjoint = simulate_adjoint(m, settings, {&cost, 1});
  INFO(forward.message << adjoint.message);
  REQUIRE((forward.ok() && adjoint.ok()));
  const double exact = forward.psi_rho.cwiseAbs().maxCoeff();
  CHECK((adjoint.psi_rho - forward.psi_rho).cwiseAbs().maxCoeff() < 1e-3 * exact);
}

// Where the drive's acceleration jumps, forward steps fall to rounding. Steps back as short do not move.
TEST_CASE("the backward run passes instants where forward steps fall to rounding", "[cvodes]") {
  Scene scene = double_pendulum();
  add_parameters(scene, {{"phi", 0.4}});
  Drive drive;
  const std::string u = "min(1, max(0, (t - 1)/" + std::to_string(GENERATE(1e-4, 7e-5)) + "))";
  drive.name = "jerk", drive.type = "angle", drive.joint = "A";
  drive.law = f("theta0 - 0.6 + phi*(3*(" + u + ")^2 - 2*(" + u + ")^3)");
  scene.drives = {drive};
  scene.simulation.end_time = 1.5;
  scene.simulation.integrator.type = "cvodes_bdf";
  const Mechanism mechanism(scene, nominal(scene));
  std::vector<Cost> costs(1);
  costs[0].terminal = std::make_shared<StateNorm>();
  long asked = 0;
  RunOptions options;
  options.progress = [&](double) { return ++asked < 100'000; };
  const SimulationResult result = simulate_adjoint(mechanism, scene.simulation, costs, options);
  INFO(result.message);
  CHECK(result.ok());
  CHECK(asked < 100'000);
}
