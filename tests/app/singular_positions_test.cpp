// Values and gradients through the singular positions of two four-bar windows, against the exact solution.
#include <catch2/catch.hpp>
#include <cmath>

#include "app/json/read_problem.hpp"
#include "optim/tradeoff/tradeoff_runs.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Of the gradient of x(10), in units of the parameters L, v, g; exact by quadrature in 30 digits.
double error_of(const Answer& answer) {
  const double exact[3] = {-9.08810439514276442, 4.60261031129771836, 0.490718878224858454}, sizes[3] = {1, 1, 9.81};
  double difference = 0, whole = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    difference = std::hypot(difference, sizes[k] * (answer.psi_rho(0, k) - exact[k]));
    whole = std::hypot(whole, sizes[k] * exact[k]);
  }
  return difference / whole;
}

struct Windows {
  Problem problem = read_problem(file_of("four_bar/windows"));
  TradeoffRuns runs{problem.scene, objectives_of(problem)};

  SimulationSettings by(const std::string& method) const {
    SimulationSettings settings = problem.scene.simulation;
    settings.integrator.type = method;
    return settings;
  }
  Answer gradients(SimulationSettings settings, double rtol, GradientMethod method) const {
    settings.integrator.rtol = rtol, settings.integrator.atol = 0.01 * rtol;
    return runs.gradients(settings, method);
  }
};

}  // namespace

TEST_CASE("gradients through singular positions gain digits with the tolerance, by adjoint and TLM, planar and spatial",
          "[singular]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Windows windows;
  SimulationSettings settings = windows.by(GENERATE(as<std::string>{}, "dopri5", "verner6", "dopri853"));
  settings.model = GENERATE(ModelChoice::planar, ModelChoice::spatial);
  double before = 0;
  for (const double rtol : {1e-9, 1e-10, 1e-11}) {
    for (const GradientMethod method : {GradientMethod::adjoint, GradientMethod::tlm}) {
      const Answer answer = windows.gradients(settings, rtol, method);
      REQUIRE(answer.ok);
      INFO(settings.integrator.type << " at " << rtol << ": gradient off by " << error_of(answer));
      CHECK(error_of(answer) < 250 * rtol + 5e-9);
      if (method == GradientMethod::tlm) continue;
      const double work = static_cast<double>(answer.statistics.rhs_evaluations);
      if (before > 0) CHECK(work < 1.8 * before);
      before = work;
    }
  }
}

// On steps placed for the nominal mechanism a stage may meet the singular position of a varied one, by chance.
TEST_CASE("differences through singular positions are those of the gradient, whatever their first step meets",
          "[singular]") {
#ifdef __SANITIZE_ADDRESS__
  return;  // twenty times slower
#endif
  const Windows windows;
  const SimulationSettings settings = windows.by("dopri5");
  for (const double rtol : {1e-7, 1e-8, 3e-9, 1e-9}) {
    const Answer answer = windows.gradients(settings, rtol, GradientMethod::differences);
    REQUIRE(answer.ok);
    INFO("at " << rtol << ": gradient off by " << error_of(answer));
    CHECK(error_of(answer) < 1e-4);
  }
}
