#include "core/run/run_arguments.hpp"

#include <catch2/catch.hpp>

#include <stdexcept>

#include "core/force/differentiated_force.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Catch::Contains;

namespace {

struct Speed final : RunningCost {
  double g(double, VecIn y, VecIn rho) const override { return rho(0) * y.tail(y.size() / 2).squaredNorm(); }
  void add_g_y(double, VecIn y, VecIn rho, double scale, VecOut out) const override {
    out.tail(y.size() / 2) += 2 * scale * rho(0) * y.tail(y.size() / 2);
  }
  void add_g_rho(double, VecIn y, VecIn, double scale, VecOut out) const override {
    out(0) += scale * y.tail(y.size() / 2).squaredNorm();
  }
};

struct ThrowingCost final : RunningCost {
  double g(double, VecIn, VecIn) const override { throw std::domain_error("no table"); }
  void add_g_y(double, VecIn, VecIn, double, VecOut) const override {}
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
};
struct ThrowingForce final : UserForce {
  std::vector<std::string> bodies() const override { return {"bar"}; }
  void Q(double, VecIn, VecIn, VecIn, VecOut) const override { throw 3; }
  void K(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
};
struct Resized final : DifferentiatedForce<Resized> {
  std::vector<std::string> bodies() const override { return {"bar"}; }
  template <class T>
  void load(double, const VectorX<T>&, const VectorX<T>&, const VectorX<T>&, VectorX<T>& Q) const {
    Q.conservativeResize(Q.size() - 1);
  }
};

}  // namespace

TEST_CASE("samples outside the simulated time are refused with their place", "[simulate]") {
  const Scene s = pendulum();
  const Mechanism m(s, nominal(s));
  const Sampling beyond{{0.5, 1.5}, [](std::size_t, const StatePoint&) {}};
  const Sampling before{{-0.1}, [](std::size_t, const StatePoint&) {}};
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, beyond),
                    Contains("times[1] is 1.5 s, outside") && Contains("0 to 1 s"));
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, before), Contains("times[0] is -0.1 s, outside"));
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, Sampling{{0.5}, {}}), Contains("observe is empty"));
  CHECK_THROWS_WITH(simulate_tlm(m, s.simulation, {}, TangentSampling{{0.5}, {}}), Contains("observe is empty"));
  Cost late;
  late.name = "late", late.samples = {{2, point_cost(std::make_shared<Speed>(), m)}};
  CHECK_THROWS_WITH(simulate(m, s.simulation, std::vector{late}), Contains("objective 'late': samples[0] is at 2 s"));
}

TEST_CASE("an end before the start is refused", "[simulate]") {
  Scene s = pendulum();
  const Mechanism m(s, nominal(s));
  s.simulation.integrator.type = GENERATE(as<std::string>{}, "dopri5", "cvodes_bdf");
  for (const double end : {-1.0, 0.0}) {
    s.simulation.end_time = end;
    CHECK_THROWS_WITH(simulate(m, s.simulation), Contains("it has to be after start_time, 0 s"));
  }
}

TEST_CASE("given steps that are not those of the run are refused", "[simulate]") {
  Scene s = pendulum();
  s.simulation.events = {0.5};
  const Mechanism m(s, nominal(s));
  const SimulationResult run = simulate(m, s.simulation);
  REQUIRE(run.ok());
  StepSequence steps = run.steps;
  const RunOptions frozen{&steps, {}};
  CHECK(simulate(m, s.simulation, {}, {}, frozen).ok());  // past an event, too
  steps.times.pop_back(), steps.sizes.pop_back();
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, {}, frozen), Contains("frozen steps: they end at"));
  steps = run.steps, steps.sizes.pop_back();
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, {}, frozen), Contains("times, but"));
  steps = run.steps, steps.times.erase(steps.times.begin()), steps.sizes.erase(steps.sizes.begin());
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, {}, frozen), Contains("frozen steps: step 0 begins at"));
  steps = {};
  CHECK_THROWS_WITH(simulate(m, s.simulation, {}, {}, frozen), Contains("frozen steps: there are none"));
}

TEST_CASE("a cost that is bound to other parameters than the mechanism is refused", "[simulate]") {
  const Scene s = pendulum();
  Eigen::VectorXd other = nominal(s);
  other(2) += 0.1;
  const Mechanism m(s, nominal(s));
  Cost cost;
  cost.name = "speed", cost.running = point_cost(std::make_shared<Speed>(), Mechanism(s, other));
  CHECK_THROWS_WITH(simulate_adjoint(m, s.simulation, std::vector{cost}),
                    Contains("objective 'speed': its running cost is bound to other parameters") && Contains("rho[2]"));
  Scene alone;
  Body stone;
  stone.name = "stone", stone.mass = 1.0, stone.inertia = {1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  alone.bodies = {stone};
  cost.running = point_cost(std::make_shared<Speed>(), Mechanism(alone, Eigen::VectorXd()));
  CHECK_THROWS_WITH(simulate(m, s.simulation, std::vector{cost}), Contains("bound to 0 parameters"));
}

TEST_CASE("forces and costs that are not there are refused", "[simulate]") {
  const Scene s = pendulum();
  const Mechanism m(s, nominal(s));
  CHECK_THROWS_WITH(Mechanism(s, nominal(s), {}, {nullptr}), Contains("user force: there is none"));
  CHECK_THROWS_WITH(point_cost(std::shared_ptr<const RunningCost>(), m), Contains("no running cost"));
  CHECK_THROWS_WITH(point_cost(std::shared_ptr<const TerminalCost>(), m), Contains("no terminal cost"));
  Cost cost;
  cost.samples = {{0.5, nullptr}};
  CHECK_THROWS_WITH(simulate(Mechanism(s, nominal(s)), s.simulation, std::vector{cost}),
                    Contains("samples[0] has no cost"));
}

TEST_CASE("what forces and costs of a user throw names them", "[simulate]") {
  const Scene s = pendulum();
  const Mechanism m(s, nominal(s));
  Cost cost;
  cost.running = point_cost(std::make_shared<ThrowingCost>(), m, "objective 'lift'");
  CHECK_THROWS_WITH(simulate(m, s.simulation, std::vector{cost}), "objective 'lift' threw: no table");
  const auto with = [&](std::shared_ptr<const UserForce> force) { return Mechanism(s, nominal(s), {}, {force}); };
  CHECK_THROWS_WITH(simulate(with(std::make_shared<ThrowingForce>()), s.simulation),
                    "user force 0 threw what is no std::exception");
  CHECK_THROWS_WITH(simulate(with(std::make_shared<Resized>()), s.simulation),
                    "user force 0 threw: load() has changed the size of its result");
}
