// The gallery's planar files: three unknowns per body give the motion and the gradient of six.
#include <catch2/catch.hpp>

#include "app/json/read_problem.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "optim/evaluator.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;

namespace {

// Of the whole gradient in units of the parameters, and of the values.
double apart(const Problem& problem, const Evaluation& a, const Evaluation& b) {
  double worst = 0;
  for (Eigen::Index i = 0; i < b.psi.size(); ++i) {
    worst = std::max(worst, std::abs(a.psi(i) - b.psi(i)) / std::max(std::abs(b.psi(i)), 1e-12));
    double largest = 0, difference = 0;
    for (std::size_t k = 0; k < problem.scene.parameters.size(); ++k) {
      const Eigen::Index column = static_cast<Eigen::Index>(k);
      const double size = std::max(std::abs(problem.scene.parameters[k].value), 1e-3);
      largest = std::max(largest, size * std::abs(b.psi_rho(i, column)));
      difference = std::max(difference, size * std::abs(a.psi_rho(i, column) - b.psi_rho(i, column)));
    }
    worst = std::max(worst, difference / std::max(largest, 1e-12));
  }
  return worst;
}

}  // namespace

TEST_CASE("the planar model gives the values and gradients of the spatial one on the planar gallery", "[planar]") {
  int files = 0;
  for (const std::string& name : gallery()) {
    Problem problem = read_problem(file_of(name));
    Scene& scene = problem.scene;
    const std::vector<Objective> objectives = objectives_of(problem);
    if (objectives.empty() || scene.parameters.empty()) continue;
    if (!Mechanism(scene, parameter_values(scene)).data().planar) continue;
    ++files;
#ifdef __SANITIZE_ADDRESS__
    if (files % 4 != 0) continue;  // twenty times slower
#endif
    scene.simulation.formulation = {};
    scene.simulation.integrator = {};
    scene.simulation.integrator.type = "dopri853";
    scene.simulation.integrator.rtol = 1e-9, scene.simulation.integrator.atol = 1e-11;
    if (name == "governor/stiff_flyball") scene.simulation.end_time = 0.05;  // explicit steps crawl through it
    EvaluatorOptions options;
    options.method = GradientMethod::adjoint;
    Evaluator planar(scene, objectives, {}, options);
    scene.simulation.model = ModelChoice::spatial;
    Evaluator spatial(scene, objectives, {}, options);
    const Evaluation& a = planar.gradients(planar.start());
    const Evaluation b = spatial.gradients_on(a.steps, spatial.start(), GradientMethod::adjoint);
    INFO(name << ": " << a.message << b.message);
    REQUIRE((a.ok && b.ok));
    CHECK(a.statistics.factor_blocks > 0);
    // Its windows pass flat positions, which magnify the rounding of both.
    CHECK(apart(problem, a, b) < (name == "four_bar/windows" ? 1e-8 : 1e-10));
  }
  CHECK(files >= 12);
}
