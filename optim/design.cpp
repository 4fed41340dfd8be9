#include "optim/design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/expression/did_you_mean.hpp"
#include "optim/ipopt_solver.hpp"
#include "optim/stopwatch.hpp"
#include "optim/variable_scaling.hpp"

namespace mbsopt {
namespace {

constexpr double kTouches = 1e-6;  // relative to the bound's size: the barrier keeps solutions this near to a bound

bool touches(double value, const std::optional<double>& bound, double size) {
  return bound && std::abs(value - *bound) <= kTouches * size;
}

std::vector<Parameter> chosen(const Scene& scene, const std::vector<int>& indices) {
  std::vector<Parameter> parameters;
  for (const int k : indices) parameters.push_back(scene.parameters[static_cast<std::size_t>(k)]);
  return parameters;
}

const DesignSpec& checked(const Problem& problem) {
  if (!problem.design) throw std::invalid_argument("design: is missing; it says what to minimise and what to vary");
  const DesignSpec& spec = *problem.design;
  if (spec.variables.empty()) throw std::invalid_argument("design.variables: is empty; name at least one parameter");
  if (spec.optimizer != "ipopt")
    throw std::invalid_argument(fmt::format("design.optimizer.type: is '{}'; available: ipopt", spec.optimizer));
  for (std::size_t i = 0; i < spec.subject_to.size(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[i];
    if (!bound.lower && !bound.upper)
      throw std::invalid_argument(fmt::format("design.subject_to[{}]: gives neither lower nor upper", i));
    if (bound.lower && bound.upper && *bound.lower > *bound.upper)
      throw std::invalid_argument(
          fmt::format("design.subject_to[{}]: lower is {}, above upper {}", i, *bound.lower, *bound.upper));
  }
  return spec;
}

std::vector<std::string> objective_names(const DesignSpec& spec) {
  std::vector<std::string> names{spec.minimize};
  for (const ObjectiveBound& bound : spec.subject_to) names.push_back(bound.objective);
  return names;
}

// The design as a nonlinear program in scaled variables; constraints relative to the size of their bounds.
class DesignProgram : public NonlinearProgram {
 public:
  DesignProgram(const DesignSpec& spec, Evaluator& evaluator, const VariableScaling& scaling)
      : NonlinearProgram(scaling.size(), static_cast<Eigen::Index>(spec.subject_to.size())),
        evaluator_(evaluator),
        scaling_(scaling),
        rho_(evaluator.start()),
        size_(constraints()) {
    x_lower = scaling.x_lower(), x_upper = scaling.x_upper();
    for (Eigen::Index i = 0; i < constraints(); ++i) {
      const ObjectiveBound& bound = spec.subject_to[static_cast<std::size_t>(i)];
      size_(i) = std::max(std::abs(bound.lower.value_or(0)), std::abs(bound.upper.value_or(0)));
      if (size_(i) == 0) size_(i) = 1;
      if (bound.lower) c_lower(i) = *bound.lower / size_(i);
      if (bound.upper) c_upper(i) = *bound.upper / size_(i);
    }
  }

  // Convergence is judged on an objective whose size and gradient are about 1: the larger of those at the start and a
  // little way from it, so that a start at the optimum, where both may vanish, is seen for what it is.
  void scale_by(const Eigen::VectorXd& x_start) {
    constexpr double kLittleWay = 0.01;
    const Eigen::VectorXd shift = kLittleWay * x_start.cwiseAbs().cwiseMax(1);
    Eigen::VectorXd inward = x_start + shift;
    for (Eigen::Index k = 0; k < inward.size(); ++k)
      if (inward(k) > x_upper(k)) inward(k) = std::max(x_start(k) - shift(k), x_lower(k));
    double f_size = 0;
    Eigen::VectorXd c_size = Eigen::VectorXd::Zero(constraints());
    for (const Eigen::VectorXd& x : {inward, x_start}) {  // the start last: the evaluator keeps it
      NlpPoint point;
      point.c.setZero(constraints()), point.c_x.setZero(constraints(), variables());
      evaluate(x, point);
      if (!point.ok) continue;
      f_size = std::max({f_size, std::abs(point.f), point.f_x.cwiseAbs().maxCoeff()});
      c_size = c_size.cwiseMax(point.c_x.cwiseAbs().rowwise().maxCoeff());
    }
    f_scale = inverse(f_size);
    c_scale = c_size.unaryExpr([](double size) { return std::min(1.0, inverse(size)); });
  }

  Eigen::VectorXd rho_at(const Eigen::VectorXd& x) const {
    Eigen::VectorXd rho = rho_;
    const Eigen::VectorXd values = scaling_.to_rho(x);
    for (Eigen::Index k = 0; k < values.size(); ++k)
      rho(evaluator_.variables()[static_cast<std::size_t>(k)]) = values(k);
    return rho;
  }

  void evaluate(const Eigen::VectorXd& x, NlpPoint& point) override {
    const Evaluation& e = evaluator_.gradients(rho_at(x));
    if (!e.ok) {
      point.ok = false, point.message = e.message;
      return;
    }
    const Eigen::VectorXd rho_x = scaling_.rho_x(x);
    point.f = e.psi(0);
    point.f_x = e.psi_rho.row(0).transpose().cwiseProduct(rho_x);
    for (Eigen::Index i = 0; i < constraints(); ++i) {
      point.c(i) = e.psi(1 + i) / size_(i);
      point.c_x.row(i) = e.psi_rho.row(1 + i).cwiseProduct(rho_x.transpose()) / size_(i);
    }
  }

  double size(Eigen::Index constraint) const { return size_(constraint); }

 private:
  static double inverse(double x) { return x > 0 && std::isfinite(x) ? 1 / x : 1; }

  Evaluator& evaluator_;
  const VariableScaling& scaling_;
  const Eigen::VectorXd rho_;  // the scene's values, which parameters that are not designed keep
  Eigen::VectorXd size_;       // of each constraint's bounds
};

void describe_start(const Problem& problem, const Evaluator& evaluator, const Evaluation& start, DesignResult& result) {
  const DesignSpec& spec = *problem.design;
  result.objective = spec.minimize;
  for (const Parameter& p : chosen(problem.scene, evaluator.variables()))
    result.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
  if (start.ok) result.objective_initial = result.objective_final = start.psi(0);
  for (std::size_t i = 0; i < spec.subject_to.size(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[i];
    const double value = start.ok ? start.psi(static_cast<Eigen::Index>(i) + 1) : 0;
    result.constraints.push_back({bound.objective, bound.lower, bound.upper, value, value, {}, 0, false, false});
  }
}

// Where a derivative is exactly zero in all that takes part, a variable goes nowhere, by symmetry or because its force
// does not act (yet).
std::vector<std::string> idle_variables(const Evaluation& start, const DesignSpec& spec, const Evaluator& evaluator) {
  std::vector<std::string> warnings;
  for (std::size_t k = 0; k < evaluator.variables().size(); ++k) {
    if (start.psi_rho.col(static_cast<Eigen::Index>(k)).any()) continue;
    warnings.push_back(fmt::format(
        "design.variables: '{}' has a derivative of exactly 0 at the start in all that the design uses ({}); it stays "
        "as it is unless others change that",
        evaluator.scene().parameters[static_cast<std::size_t>(evaluator.variables()[k])].name,
        joined(objective_names(spec))));
  }
  return warnings;
}

void describe_end(const Evaluator& evaluator, const DesignProgram& program, const NlpPoint& end, DesignResult& result) {
  for (std::size_t k = 0; k < result.variables.size(); ++k) {
    DesignVariable& v = result.variables[k];
    v.value = result.rho(evaluator.variables()[k]);
    const double size = v.lower && v.upper ? *v.upper - *v.lower : std::max(std::abs(v.initial), std::abs(v.value));
    v.at_lower = touches(v.value, v.lower, size), v.at_upper = touches(v.value, v.upper, size);
  }
  result.objective_final = end.f;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    c.value = end.c(row) * program.size(row);
    c.violation = std::max({0.0, c.lower ? *c.lower - c.value : 0.0, c.upper ? c.value - *c.upper : 0.0});
    c.at_lower = touches(c.value, c.lower, program.size(row)),
    c.at_upper = touches(c.value, c.upper, program.size(row));
  }
}

}  // namespace

DesignResult run_design(const Problem& problem, const DesignOptions& options) {
  const Stopwatch stopwatch;
  const DesignSpec& spec = checked(problem);
  EvaluatorOptions evaluator_options;
  evaluator_options.method = options.method;
  evaluator_options.user_forces = options.user_forces;
  bool abandoned = false;
  if (options.simulation_progress)
    evaluator_options.progress = [&](double t) {
      return abandoned = abandoned || !options.simulation_progress(t), !abandoned;
    };
  Evaluator evaluator(problem.scene, objectives_of(problem, objective_names(spec)), spec.variables, evaluator_options);
  const VariableScaling scaling(chosen(problem.scene, evaluator.variables()));
  DesignProgram program(spec, evaluator, scaling);

  DesignResult result;
  result.optimizer = spec.optimizer;
  Eigen::VectorXd designed(scaling.size());
  for (Eigen::Index k = 0; k < designed.size(); ++k)
    designed(k) = evaluator.start()(evaluator.variables()[static_cast<std::size_t>(k)]);
  const Eigen::VectorXd x_start = scaling.to_x(designed);
  const Evaluation start = evaluator.gradients(program.rho_at(x_start));
  result.gradient_choice = start.choice.empty() ? std::string(to_string(start.method)) : start.choice;
  describe_start(problem, evaluator, start, result);
  if (start.ok) result.warnings = idle_variables(start, spec, evaluator);
  if (start.ok) program.scale_by(x_start);

  IpoptOptions solver;
  solver.tolerance = spec.tolerance;
  solver.max_iterations = spec.max_iterations;
  solver.progress = [&](const NlpProgress& p) {
    result.history.push_back({p.iteration, p.f, p.violation, p.optimality, scaling.to_rho(p.x)});
    return !options.progress || options.progress(result.history.back());
  };
  const NlpResult solution = solve_with_ipopt(program, x_start, solver);
  result.status = abandoned ? SolverStatus::stopped : solution.status;
  result.message = abandoned ? "stopped on request" : solution.message;
  result.iterations = solution.iterations;
  result.evaluations = solution.evaluations, result.failed_evaluations = solution.failed_evaluations;
  result.rho = program.rho_at(solution.x);
  if (start.ok) {
    describe_end(evaluator, program, solution.point, result);
    if (!abandoned) {
      result.final_evaluation = evaluator.gradients(result.rho);
      const std::vector<std::optional<double>> true_values = evaluator.true_values(result.rho);
      result.objective_true = true_values[0];
      for (std::size_t i = 0; i < result.constraints.size(); ++i) result.constraints[i].true_value = true_values[i + 1];
    }
  }
  result.simulations = evaluator.simulations();
  result.wall_seconds = stopwatch.seconds();
  return result;
}

}  // namespace mbsopt
