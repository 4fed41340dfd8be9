// Discrete derivatives of whole simulations: TLM against adjoint, both against differences on frozen steps, for every
// method, formulation and projection; users' own costs and forces.
#include <catch2/catch.hpp>

#include "core/simulate/simulation.hpp"
#include "core/tableau/tableaus.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A cost as a user writes it: g = rho_0 |v|^2 + cos(t) q_1, terminal: rho_1 q'q.
struct UserRunningCost final : RunningCost {
  double g(double t, VecIn y, VecIn rho) const override {
    return rho(0) * y.tail(y.size() / 2).squaredNorm() + std::cos(t) * y(1);
  }
  void add_g_y(double t, VecIn y, VecIn rho, double scale, VecOut out) const override {
    out.tail(y.size() / 2) += 2 * scale * rho(0) * y.tail(y.size() / 2);
    out(1) += scale * std::cos(t);
  }
  void add_g_rho(double, VecIn y, VecIn, double scale, VecOut out) const override {
    out(0) += scale * y.tail(y.size() / 2).squaredNorm();
  }
};
struct UserTerminalCost final : TerminalCost {
  double value(VecIn y, VecIn rho) const override { return rho(1) * y.head(y.size() / 2).squaredNorm(); }
  void adjoint_init(VecIn y, VecIn rho, VecOut lambda, VecOut mu) const override {
    lambda.head(y.size() / 2) = 2 * rho(1) * y.head(y.size() / 2);
    mu(1) = y.head(y.size() / 2).squaredNorm();
  }
};

struct Case {
  Scene scene = every_force_four_bar();
  std::vector<std::shared_ptr<const UserForce>> forces;

  Case() {
    scene.simulation.end_time = 0.25;
    forces = {std::make_shared<CubicDrag>("coupler", static_cast<Eigen::Index>(scene.parameters.size()) - 1)};
  }
  Mechanism mechanism(const VectorXd& rho) const { return Mechanism(scene, rho, {}, forces); }

  std::vector<Cost> costs(const Mechanism& m) const {
    const int angle = m.sensor("angle"), z = m.sensor("z"), v = m.sensor("v");
    std::vector<Cost> list(3);
    list[0].running = std::make_shared<SensorProduct>(m, z, z);
    list[0].terminal = std::make_shared<SensorProduct>(m, angle, v);
    list[1].running = std::make_shared<SensorProduct>(m, v, angle);
    list[1].samples = {{0.0, std::make_shared<SensorProduct>(m, z, angle)},
                       {0.1234, std::make_shared<SensorProduct>(m, angle, angle)},
                       {0.1235, std::make_shared<SensorProduct>(m, v, z)},
                       {0.25, std::make_shared<SensorProduct>(m, z, v)}};
    list[2].running = point_cost(std::make_shared<UserRunningCost>(), m);
    list[2].terminal = point_cost(std::make_shared<UserTerminalCost>(), m);
    return list;
  }
};

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method& rk : runge_kutta_methods()) names.emplace_back(rk.name);
#ifdef __SANITIZE_ADDRESS__
  names = {"dopri5", "sdirk4", "radau5"};  // twenty times slower
#endif
  return names;
}

FormulationSettings formulation(const std::string& name) {
  FormulationSettings s;
  if (name == "penalty") {
    s = FormulationSettings::penalty();
    s.alpha = 1e4;  // plain Cholesky: rounding errors grow with alpha
  } else if (name == "penalty, projected") {
    s = FormulationSettings::penalty();
    s.alpha = 1e4, s.omega = 0, s.projection = Projection::position_velocity;
  } else if (name.starts_with("quasidefinite")) {
    s = FormulationSettings::penalty();
    s.linear_solver = LinearSolver::quasidefinite;
    if (name == "quasidefinite, velocity") s.projection = Projection::velocity, s.omega = 0;
    if (name == "quasidefinite, projected") s.projection = Projection::position_velocity, s.omega = 0;
  } else if (name == "velocity") {
    s.projection = Projection::velocity;
  } else if (name == "stabilised") {
    s.projection = Projection::none, s.omega = 10;
  }
  return s;
}

}  // namespace

TEST_CASE("TLM equals adjoint to 1e-10 for every method, formulation and projection", "[gradient]") {
  Case c;
  const std::string method = GENERATE(from_range(method_names()));
  const std::string form =
      GENERATE(as<std::string>{}, "augmented_lagrangian", "velocity", "stabilised", "penalty", "penalty, projected",
               "quasidefinite", "quasidefinite, velocity", "quasidefinite, projected");
  c.scene.simulation.formulation = formulation(form);
  c.scene.simulation.integrator.type = method;
  if (!runge_kutta_method(method)->adaptive) c.scene.simulation.integrator.step = 0.01;
  const Mechanism m = c.mechanism(nominal(c.scene));
  const std::vector<Cost> costs = c.costs(m);
  RunOptions exact;
  exact.exact_stages = true;
  const SimulationResult forward = simulate(m, c.scene.simulation, costs, {}, exact);
  const SimulationResult tlm = simulate_tlm(m, c.scene.simulation, costs);
  const SimulationResult adjoint = simulate_adjoint(m, c.scene.simulation, costs);
  INFO(method << ", " << form << ": " << forward.message << tlm.message << adjoint.message);
  REQUIRE((forward.ok() && tlm.ok() && adjoint.ok()));
  CHECK(forward.psi == tlm.psi);
  CHECK(forward.psi == adjoint.psi);
  const double size = tlm.psi_rho.cwiseAbs().maxCoeff();
  for (Eigen::Index o = 0; o < 3; ++o) {
    for (Eigen::Index k = 0; k < tlm.psi_rho.cols(); ++k) {
      INFO(c.scene.parameters[static_cast<std::size_t>(k)].name << ": " << tlm.psi_rho(o, k));
      CHECK(std::abs(tlm.psi_rho(o, k) - adjoint.psi_rho(o, k)) <=
            1e-10 * std::max(std::abs(tlm.psi_rho(o, k)), 1e-3 * size));
    }
  }
}

TEST_CASE("the gradient equals differences on frozen steps to 1e-7 for every parameter", "[gradient]") {
  Case c;
  const std::string method = GENERATE(from_range(method_names()));
  c.scene.simulation.formulation = formulation(GENERATE(as<std::string>{}, "augmented_lagrangian", "quasidefinite"));
  c.scene.simulation.integrator.type = method;
  // With step control the methods of order 2, lobatto3c, whose estimate is of order 2, and rodas4 evaluate costs so
  // near v = 0, a norm, that differences straddle its kink.
  const Method& rk = *runge_kutta_method(method);
  const bool many_steps = rk.order == 2 || rk.name == "lobatto3c" || rk.gamma;
  if (!rk.adaptive || many_steps) c.scene.simulation.integrator.step = 0.005;
  const VectorXd rho = nominal(c.scene);
  const Mechanism m = c.mechanism(rho);
  const std::vector<Cost> costs = c.costs(m);
  const SimulationResult adjoint = simulate_adjoint(m, c.scene.simulation, costs);
  REQUIRE(adjoint.ok());
  const RunOptions frozen{&adjoint.steps, {}};
  auto psi = [&](const VectorXd& at) {
    const Mechanism moved = c.mechanism(at);
    const SimulationResult run = simulate(moved, c.scene.simulation, c.costs(moved), {}, frozen);
    REQUIRE(run.ok());
    return run.psi;
  };
  // Implicit stages are solved to rounding along another way.
  const double same = runge_kutta_method(method)->implicit() ? 1e-11 : 1e-13;
  CHECK((psi(rho) - adjoint.psi).cwiseAbs().maxCoeff() < same * adjoint.psi.cwiseAbs().maxCoeff());
  const double size = adjoint.psi_rho.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    auto difference = [&](double step) {
      VectorXd up = rho, down = rho;
      up(k) += step, down(k) -= step;
      return VectorXd((psi(up) - psi(down)) / (2 * step));
    };
    auto error = [&](double step) {
      const double h = step * std::max(1.0, std::abs(rho(k)));
      const VectorXd extrapolated = (4 * difference(h / 2) - difference(h)) / 3;
      return VectorXd((extrapolated - adjoint.psi_rho.col(k)).cwiseAbs());
    };
    // Rounding is less with the large step. The small one may keep clear of the kink where the large one straddles it.
    const VectorXd least = error(2e-4).cwiseMin(error(2e-5));
    INFO(method << ": " << c.scene.parameters[static_cast<std::size_t>(k)].name);
    for (Eigen::Index o = 0; o < 3; ++o) {
      CHECK(least(o) <= 1e-7 * std::max(std::abs(adjoint.psi_rho(o, k)), 1e-3 * size));
    }
  }
}

TEST_CASE("derivatives in a few parameters are those among all of them", "[gradient]") {
  Case c;
  const VectorXd rho = nominal(c.scene);
  const Mechanism all = c.mechanism(rho);
  std::vector<bool> active(static_cast<std::size_t>(rho.size()), false);
  active[1] = active[12] = active[22] = true;
  const Mechanism few(c.scene, rho, active, {});
  const Mechanism all_without(c.scene, rho, {}, {});
  const SimulationResult wide = simulate_adjoint(all_without, c.scene.simulation, c.costs(all_without));
  const SimulationResult tlm = simulate_tlm(few, c.scene.simulation, c.costs(few));
  const SimulationResult adjoint = simulate_adjoint(few, c.scene.simulation, c.costs(few));
  for (const Eigen::Index k : {1, 12, 22}) {
    CHECK((wide.psi_rho.col(k) - tlm.psi_rho.col(k)).norm() < 1e-10 * wide.psi_rho.norm());
    CHECK((wide.psi_rho.col(k) - adjoint.psi_rho.col(k)).norm() < 1e-10 * wide.psi_rho.norm());
  }
}

TEST_CASE("sampled states carry the derivative of the dense output", "[gradient]") {
  Case c;
  c.scene.simulation.integrator.type = GENERATE(as<std::string>{}, "dopri5", "dopri853");
  const VectorXd rho = nominal(c.scene);
  const std::vector<double> times{0.0, 0.031, 0.127, 0.25};
  std::vector<MatrixXd> y_rho(times.size());
  std::vector<VectorXd> y(times.size());
  TangentSampling tangent;
  tangent.times = times;
  tangent.observe = [&](std::size_t i, const StatePoint& at, const MatrixXd& d) { y[i] = at.y, y_rho[i] = d; };
  const SimulationResult run = simulate_tlm(c.mechanism(rho), c.scene.simulation, {}, tangent);
  REQUIRE(run.ok());
  auto states = [&](const VectorXd& at) {
    std::vector<VectorXd> out(times.size());
    Sampling sampling{times, [&](std::size_t i, const StatePoint& p) { out[i] = p.y; }};
    REQUIRE(simulate(c.mechanism(at), c.scene.simulation, {}, sampling, {&run.steps, {}}).ok());
    return out;
  };
  const std::vector<VectorXd> base = states(rho);
  for (std::size_t i = 0; i < times.size(); ++i) CHECK((base[i] - y[i]).cwiseAbs().maxCoeff() < 1e-13);
  for (const Eigen::Index k : {0, 5, 13, 18}) {
    const double h = 1e-6;
    VectorXd up = rho, down = rho;
    up(k) += h, down(k) -= h;
    const std::vector<VectorXd> plus = states(up), minus = states(down);
    for (std::size_t i = 0; i < times.size(); ++i) {
      const VectorXd difference = (plus[i] - minus[i]) / (2 * h);
      CHECK((difference - y_rho[i].col(k)).cwiseAbs().maxCoeff() < 1e-7 * (1 + y_rho[i].col(k).cwiseAbs().maxCoeff()));
    }
  }
}
