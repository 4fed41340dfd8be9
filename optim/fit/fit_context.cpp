#include "optim/fit/fit_context.hpp"

#include <utility>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

LeastSquaresOptions solver_options(const FitContext& fit) {
  LeastSquaresOptions solver;
  solver.tolerance = fit.spec.tolerance;
  solver.max_iterations = fit.options.preflight ? 0 : fit.spec.max_iterations;
  return solver;
}

ExperimentStack stack_of(const FitContext& fit, const std::vector<std::size_t>& experiments, const Eigen::VectorXd& rho,
                         std::vector<UnknownParameter> unknowns) {
  std::vector<ExperimentStack::Member> members;
  for (const std::size_t e : experiments) {
    const ExperimentSpec& spec = fit.spec.experiments[e];
    members.push_back({e,
                       Experiment(fit.scene, spec, place_of(fit.spec, e), fit.data[e], rho,
                                  unknowns_in(fit.scene, fit.spec, e, unknowns), fit.options.user_forces),
                       spec.origin && spec.origin->continues, spec.origin && spec.origin->number > 1});
  }
  return {std::move(members), std::move(unknowns), fit.spec.loss, fit.go_on, fit.options.threads};
}

ExperimentStack fitted_stack(const FitContext& fit) {
  std::vector<std::size_t> experiments;
  for (std::size_t e = 0; e < fit.spec.experiments.size(); ++e)
    if (!fit.spec.experiments[e].validate) experiments.push_back(e);
  return stack_of(fit, experiments, parameter_values(fit.scene), unknowns_of_fit(fit.scene, fit.spec));
}

}  // namespace mbsopt::inline optim
