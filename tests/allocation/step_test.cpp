// The hot loops allocate nothing after set-up: right-hand sides, steps, tangents and adjoints.
#include <catch2/catch.hpp>

#include "core/cvodes/cvodes_linear_solver.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/integrate/runge_kutta_run.hpp"
#include "core/projection/projection.hpp"
#include "core/start/assembly.hpp"
#include "tests/allocation/allocation_count.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

struct Prepared {
  Scene scene = every_force_four_bar();
  Mechanism mechanism{scene,
                      nominal(scene),
                      {},
                      {std::make_shared<CubicDrag>("coupler", static_cast<Eigen::Index>(scene.parameters.size()) - 1)}};
  VectorXd y = VectorXd::Zero(mechanism.states()), angles = VectorXd::Zero(1), rate = y;

  Prepared() {
    for (int i = 1; i <= 3; ++i) y.segment<7>(7 * (i - 1)) = mechanism.data().bodies[static_cast<std::size_t>(i)].q;
  }
};

// The allocations of a run whose every step has dense output, with its result.
std::pair<long, SimulationStatistics> allocations_of_run(const Mechanism& mechanism, const SimulationSettings& settings,
                                                         const char* method, const VectorXd& y,
                                                         const VectorXd& angles) {
  struct Reader final : StepObserver {
    bool reads_inside(double) const override { return true; }
    std::string look_at(const SeenStep&) override { return {}; }
  } reader;
  StepObserver* const observer = &reader;
  StepAttempt attempt(mechanism, settings, *runge_kutta_method(method));
  SimulationResult result;
  result.steps.times.reserve(100000);  // all that may differ is the growth of the recorded list of steps
  result.steps.sizes.reserve(100000);
  const RunOptions options;
  const long before = allocation_count();
  RungeKuttaRun(attempt, {}, options, result).go(y, angles, {&observer, 1});
  const long after = allocation_count();
  REQUIRE(result.ok());
  return {after - before, result.statistics};
}

}  // namespace

TEST_CASE("a right-hand side, its tangent and its adjoint allocate nothing", "[allocation]") {
  Prepared p;
  FormulationSettings formulation;
  if (GENERATE(false, true)) {
    formulation = FormulationSettings::penalty();
    formulation.linear_solver = LinearSolver::quasidefinite;
  }
  SpatialDynamics dynamics(p.mechanism, formulation);
  const auto blocks = parameter_blocks(p.mechanism.data());
  LaneRows direction = LaneRows::Random(p.y.size(), kLanes), out(p.y.size(), kLanes);
  VectorXd w = VectorXd::Random(p.y.size()), y_bar = VectorXd::Zero(p.y.size());
  VectorXd theta_bar = VectorXd::Zero(p.mechanism.data().slots()), rho_bar = VectorXd::Zero(p.mechanism.parameters());
  dynamics.terms().blocks();  // sets up what derivatives need
  const long before = allocation_count();
  bool ok = true;
  for (int k = 0; k < 3; ++k) {
    ok = ok && dynamics.evaluate(0.1 * k, p.y, p.angles, p.rate);
    dynamics.linearise_here();
    for (const ParameterBlock& block : blocks) dynamics.tangent(block, direction, out);
    dynamics.add_adjoint(w, y_bar, theta_bar, rho_bar);
  }
  const long after = allocation_count();
  CHECK(ok);
  CHECK(after == before);
}

TEST_CASE("what CVODES calls, and BDF's Newton matrix, allocate nothing", "[allocation]") {
  Prepared p;
  cvodes::Flow flow(p.mechanism, {});
  flow.start(0, p.angles);
  ShiftedSystem newton(p.mechanism.data(), flow.dynamics());
  VectorXd x = VectorXd::Random(p.y.size());
  const cvodes::Flow::Numbers y(p.y.data(), p.y.size());
  const auto factor = [&](double t, double gamma) {
    if (!flow.evaluate(t, y) || !flow.linearise(t, y)) return false;
    newton.linearise(t, p.y, flow.angles_at(t), flow.ydot().tail(p.y.size() / 2), flow.dynamics().lambda());
    return newton.factor(gamma);
  };
  bool ok = factor(0, 0.02);  // the first factor chooses pivots and makes room for them
  const long before = allocation_count();
  for (int k = 0; k < 3; ++k) {
    ok = ok && factor(0.1 * k, 0.01 * (k + 1));
    newton.solve(x, 1);
  }
  const long after = allocation_count();
  CHECK(ok);
  CHECK(x.allFinite());
  CHECK(after == before);
}

TEST_CASE("a projection, its tangent and its adjoint allocate nothing", "[allocation]") {
  Prepared p;
  const std::unique_ptr<Projector> projector = make_projector(p.mechanism, Projection::position_velocity);
  ProjectionSolution solution = projector->solution();
  const auto blocks = parameter_blocks(p.mechanism.data());
  LaneRows direction = LaneRows::Random(p.y.size(), kLanes), out(p.y.size(), kLanes);
  VectorXd w = VectorXd::Random(p.y.size()), y_bar = VectorXd::Zero(p.y.size()), projected = p.y;
  VectorXd theta_bar = VectorXd::Zero(p.mechanism.data().slots());
  VectorXd rho_bar = VectorXd::Zero(p.mechanism.parameters());
  const long before = allocation_count();
  const bool ok = projector->project(0, p.angles, p.y, projected, solution) &&
                  projector->linearise(0, p.angles, p.y, projected, solution);
  for (const ParameterBlock& block : blocks) projector->tangent(block, direction, out);
  projector->add_adjoint(w, y_bar, theta_bar, rho_bar);
  const long after = allocation_count();
  CHECK(ok);
  CHECK(after == before);
}

TEST_CASE("steps allocate nothing after the first, whatever their number", "[allocation]") {
  Prepared p;
  const std::string method = GENERATE(as<std::string>{}, "dopri5", "dopri853", "sdirk4", "rodas4", "radau5");
  auto allocations = [&](double end) {  // the same motion over two spans
    SimulationSettings settings = p.scene.simulation;
    settings.end_time = end;
    settings.formulation.projection = Projection::position_velocity;
    const std::unique_ptr<Projector> projector = make_projector(p.mechanism, Projection::position_velocity);
    ProjectionSolution solution = projector->solution();
    VectorXd y = p.y;
    REQUIRE(projector->project(0, p.angles, p.y, y, solution));
    const auto [allocated, statistics] = allocations_of_run(p.mechanism, settings, method.c_str(), y, p.angles);
    return std::pair(allocated, statistics.steps);
  };
  const auto [few, few_steps] = allocations(0.05);
  const auto [many, many_steps] = allocations(0.5);
  CHECK(many_steps > 2 * few_steps);
  CHECK(many == few);
}

// Where steps are placed anew, and errors are measured after projection.
TEST_CASE("steps past singular positions allocate nothing", "[allocation][singular]") {
  const Scene scene = n_four_bar(2);
  const Mechanism mechanism(scene, VectorXd());
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  auto allocations = [&](double end) {
    SimulationSettings settings = scene.simulation;
    settings.end_time = end;
    const auto [allocated, statistics] =
        allocations_of_run(mechanism, settings, "dopri853", assembly.result().y, VectorXd());
    return std::pair(allocated, statistics.rejected);
  };
  const auto [few, none] = allocations(0.3);
  const auto [many, rejected] = allocations(5);
  CHECK(rejected > 0);
  CHECK(many == few);
}
