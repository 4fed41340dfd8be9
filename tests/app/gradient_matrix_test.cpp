// TLM against adjoint on the problem files themselves: every method, formulation and projection, in a few fixed steps.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/json/read_problem.hpp"
#include "core/tableau/tableaus.hpp"
#include "optim/objective/evaluator.hpp"
#include "tests/app/gallery_files.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Index;

namespace {

constexpr double kShare = 4e-2;  // of the simulated time
constexpr int kSteps = 20;

struct Form {
  std::string name;
  FormulationSettings settings;
};

std::vector<Form> forms() {
  FormulationSettings projected, velocity, free, penalty = FormulationSettings::penalty();
  velocity.projection = Projection::velocity;
  free.projection = Projection::none, free.omega = 10;
  penalty.alpha = 1e6;  // rounding errors of the factor, which grow with alpha, are refined away
  FormulationSettings accurate = penalty;
  accurate.linear_solver = LinearSolver::quasidefinite;
  accurate.projection = Projection::position_velocity;
  return {{"augmented Lagrangian", projected},
          {"augmented Lagrangian, velocity", velocity},
          {"augmented Lagrangian, stabilised", free},
          {"penalty", penalty},
          {"penalty, quasi-definite, projected", accurate}};
}

}  // namespace

TEST_CASE("TLM equals adjoint to rounding on the small problem files, whatever the method and formulation",
          "[gallery][gradient]") {
  int files = 0;
  for (const std::string& name : gallery()) {
    Problem problem = read_problem(file_of(name));
    Scene& scene = problem.scene;
    if (scene.simulation.accuracy) continue;  // chooses an implicit method: too stiff for steps of that size
    const Method* own = runge_kutta_method(scene.simulation.integrator.type);
    if (!own || own->implicit()) continue;  // stiff: explicit methods would not be stable in steps of that size
    if (scene.bodies.size() > 8 || problem.objectives.empty() || scene.parameters.size() > 12) continue;
#ifdef __SANITIZE_ADDRESS__
    if (++files % 8 != 0) continue;  // twenty times slower
#else
    ++files;
#endif
    const double span = scene.simulation.end_time - scene.simulation.start_time;
    scene.simulation.end_time = scene.simulation.start_time + kShare * span;
    scene.simulation.integrator.step = kShare * span / kSteps;
    for (ObjectiveSpec& objective : problem.objectives) {
      std::erase_if(objective.samples,
                    [&](const ObjectiveSample& sample) { return sample.time > scene.simulation.end_time; });
    }
    // Without these samples some parameters act on no objective.
    for (Parameter& parameter : scene.parameters) parameter.allow_unused = true;
    const std::vector<Objective> objectives = objectives_of(problem);
    for (const Method& rk : runge_kutta_methods()) {
      // rodas4 takes second derivatives by a formula that magnifies rounding 640 times.
      const double agree = rk.gamma ? 1e-9 : 1e-10;
      scene.simulation.integrator.type = std::string(rk.name);
      for (const Form& form : forms()) {
        scene.simulation.formulation = form.settings;
        auto gradients = [&](GradientMethod method) {
          EvaluatorOptions options;
          options.method = method;
          Evaluator evaluator(scene, objectives, {}, options);
          return evaluator.gradients(evaluator.start());
        };
        const Evaluation tlm = gradients(GradientMethod::tlm), adjoint = gradients(GradientMethod::adjoint);
        INFO(name << ", " << rk.name << ", " << form.name << ": " << tlm.message << adjoint.message);
        REQUIRE((tlm.ok && adjoint.ok));
        const Eigen::VectorXd size = tlm.rho.cwiseAbs().cwiseMax(1e-6);
        for (Index o = 0; o < tlm.psi_rho.rows(); ++o) {
          const Eigen::VectorXd a = tlm.psi_rho.row(o).transpose().cwiseProduct(size),
                                b = adjoint.psi_rho.row(o).transpose().cwiseProduct(size);
          const double largest = a.cwiseAbs().maxCoeff();
          for (Index k = 0; k < a.size(); ++k) {
            INFO(objectives[static_cast<std::size_t>(o)].name()
                 << " in " << scene.parameters[static_cast<std::size_t>(k)].name);
            INFO("TLM " << a(k) << ", adjoint differs by " << b(k) - a(k) << ", largest " << largest);
            CHECK(std::abs(a(k) - b(k)) <= agree * std::max(std::abs(a(k)), 1e-2 * largest));
          }
        }
      }
    }
  }
#ifndef __SANITIZE_ADDRESS__
  CHECK(files >= 20);
#endif
}
