#include "optim/check/checked_run.hpp"

#include <fmt/format.h>

#include <limits>
#include <optional>
#include <random>

namespace mbsopt::inline optim {
namespace {

using Eigen::VectorXd;

// Changes masses, places, rates and points, each by its own relative change of at most `largest`, so that none cancel.
Scene with_numbers_changed(Scene scene, double largest, unsigned seed) {
  std::mt19937 generator{seed};
  std::uniform_real_distribution<double> change(-largest, largest);
  const auto changed = [&](const Field& x) {
    return Expression::parse(fmt::format("({})*{:.17g}", x.text(), 1 + change(generator)));
  };
  const auto nudge = [&](VectorField& v) {
    for (Field& x : v) x = changed(x);
  };
  for (Body& body : scene.bodies) {
    body.mass = changed(body.mass);
    nudge(body.position);
    nudge(body.velocity);
    nudge(body.angular_velocity);
    for (auto& [name, point] : body.points) nudge(point);
  }
  for (Joint& joint : scene.joints)
    for (PointField* point : {&joint.point1, &joint.point2})
      if (auto* given = std::get_if<VectorField>(point)) nudge(*given);
  return scene;
}

// Records how f(units, method) differs between points some units in the last place apart.
template <class F>
void note(F&& f, RoundingScatter& scatter) {
  for (const GradientMethod method : {GradientMethod::tlm, GradientMethod::adjoint}) {
    std::optional<Evaluation> first;
    for (const double units : {8.0, 12.0, 16.0}) {
      const Evaluation e = f(units, method);
      if (!e.ok) continue;
      if (!first) {
        first = e;
        continue;
      }
      scatter.psi_rho = scatter.psi_rho.cwiseMax((e.psi_rho - first->psi_rho).cwiseAbs());
      const VectorXd slope = first->psi_rho * (e.rho - first->rho);
      scatter.psi = scatter.psi.cwiseMax((e.psi - first->psi - slope).cwiseAbs());
    }
  }
}

}  // namespace

RoundingScatter rounding_scatter(CheckedRun& run, unsigned seed) {
  constexpr double kUnit = std::numeric_limits<double>::epsilon();
  RoundingScatter scatter{kPsiRounding * run.psi.cwiseAbs(), Eigen::MatrixXd::Zero(run.psi.size(), run.rho.size())};
  for (const double unit : {kUnit, -kUnit, 1e4 * kUnit, -1e4 * kUnit})
    note(
        [&](double units, GradientMethod method) {
          return run.frozen_gradients(VectorXd(run.rho + units * unit * run.size), method);
        },
        scatter);
  note(
      [&](double units, GradientMethod method) {
        return run.frozen_gradients(with_numbers_changed(run.evaluator.scene(), units * kUnit, seed), method);
      },
      scatter);
  // A parameter has no further effect if a change by its own size changes psi by less than its rounding.
  scatter.psi_rho = scatter.psi_rho.cwiseMax(scatter.psi * run.size.cwiseInverse().transpose());
  return scatter;
}

}  // namespace mbsopt::inline optim
