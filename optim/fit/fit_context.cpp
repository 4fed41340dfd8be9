#include "optim/fit/fit_context.hpp"

#include <optional>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

LeastSquaresOptions solver_options(const FitContext& fit) {
  LeastSquaresOptions solver;
  solver.tolerance = fit.spec.tolerance;
  solver.max_iterations = fit.options.preflight ? 0 : fit.spec.max_iterations;
  return solver;
}

ExperimentStack::Member member(const FitContext& fit, std::size_t e, const Eigen::VectorXd& rho,
                               const std::vector<UnknownParameter>& unknowns) {
  const std::optional<WindowOrigin>& origin = fit.spec.experiments[e].origin;
  return {e,
          Experiment(fit.scene, fit.spec.experiments[e], place_of(fit.spec, e), fit.data[e], rho,
                     unknowns_in(fit.scene, fit.spec, e, unknowns), fit.options.user_forces),
          origin && origin->continues, origin && origin->number > 1};
}

std::vector<ExperimentStack::Member> fitted_members(const FitContext& fit,
                                                    const std::vector<UnknownParameter>& unknowns) {
  std::vector<ExperimentStack::Member> members;
  for (std::size_t e = 0; e < fit.spec.experiments.size(); ++e)
    if (!fit.spec.experiments[e].validate) members.push_back(member(fit, e, parameter_values(fit.scene), unknowns));
  return members;
}

}  // namespace mbsopt::inline optim
