#include <catch2/catch.hpp>

#include "core/integrate/simulation.hpp"
#include "core/integrate/tableaus.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

TEST_CASE("scratch", "[implicit]") {
  Scene scene = loaded_four_bar();
  scene.simulation.end_time = 0.96;
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-12;
  scene.simulation.integrator.atol = 1e-13;
  const VectorXd exact = simulate(Mechanism(scene, nominal(scene)), scene.simulation).y_end;
  for (const Method& rk : runge_kutta_methods()) {
    for (const double h : {0.02, 0.01, 0.005}) {
      scene.simulation.integrator.type = std::string(rk.name);
      scene.simulation.integrator.step = h;
      const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
      UNSCOPED_INFO(rk.name << " h " << h << " ok " << run.ok() << " " << run.message << " error "
                            << (run.y_end - exact).norm() << " rhs " << run.statistics.rhs_evaluations << " jac "
                            << run.statistics.jacobians << " fact " << run.statistics.factorisations);
    }
    scene.simulation.integrator.step.reset();
    if (!rk.adaptive) continue;
    for (const double tol : {1e-4, 1e-6, 1e-8}) {
      scene.simulation.integrator.rtol = tol;
      scene.simulation.integrator.atol = tol;
      const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
      UNSCOPED_INFO(rk.name << " tol " << tol << " ok " << run.ok() << " " << run.message << " error "
                            << (run.y_end - exact).norm() << " steps " << run.statistics.steps << "+"
                            << run.statistics.rejected << " rhs " << run.statistics.rhs_evaluations << " jac "
                            << run.statistics.jacobians << " fact " << run.statistics.factorisations);
    }
  }
  CHECK(false);
}
