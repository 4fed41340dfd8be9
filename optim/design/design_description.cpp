#include "optim/design/design_description.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/expression/did_you_mean.hpp"
#include "optim/solver/optimality.hpp"

namespace mbsopt::inline optim {
namespace {

// Times the tolerance of least squares. If the cost settles to 1e-10 of itself, optimality is known to the root of
// that.
constexpr double kSettled = 1000;
constexpr double kTouches = 1e-5;  // relative to the bound's size: the barrier keeps solutions this near to a bound
constexpr double kTrueLimitTolerance = 1e-6;  // of an equality of a true extreme; inequalities hold exactly
constexpr double kWide = 10;  // sizes of a variable: the barrier keeps it as near to bounds that are wider

bool touches(double value, const std::optional<double>& bound, double size) {
  return bound && std::abs(value - *bound) <= kTouches * size;
}

// Warns of variables whose derivatives are all exactly zero: by symmetry, or because their force does not act yet. The
// search does not move them.
void warn_of_idle_variables(const Evaluation& start, const DesignSpec& spec, DesignResult& result) {
  for (std::size_t k = 0; k < spec.variables.size(); ++k)
    if (!start.psi_rho.col(static_cast<Eigen::Index>(k)).any())
      result.warnings.push_back(
          fmt::format("design.variables: '{}' has a derivative of exactly 0 at the start in all that the design uses "
                      "({}); it stays "
                      "as it is unless others change that",
                      spec.variables[k], joined(objective_names(spec))));
}

double missed(const DesignConstraint& c, double value) {
  return std::max({0.0, c.lower ? *c.lower - value : 0.0, c.upper ? value - *c.upper : 0.0});
}

std::string limit_text(const std::string& name, bool is_upper, double bound) {
  return fmt::format("{} {} {:.6g}", name, is_upper ? "<=" : ">=", bound);
}

// The limits and bounds that stand against each other where no point near satisfies all limits.
void describe_conflict(const DesignProgram& program, const Eigen::VectorXd& x, const NlpPoint& end,
                       DesignResult& result) {
  constexpr double kNoPrice = 1e-6;  // relative to that of a limit that is violated, 1
  const Conflict found = conflict(program, x, end, kConstraintTolerance);
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    const DesignConstraint& c = result.constraints[i];
    const double z = found.of_constraints(static_cast<Eigen::Index>(i));
    if (std::abs(z) <= kNoPrice) continue;
    const double size = program.size(static_cast<Eigen::Index>(i)), missed = std::max(c.violation, c.true_violation);
    result.conflicts.push_back({limit_text(c.in_words(), z > 0, z > 0 ? *c.upper : *c.lower),
                                missed > kConstraintTolerance * size ? missed : 0, std::abs(z) / size});
  }
  const Eigen::VectorXd rho_x = program.scaling().rho_x(x);
  for (std::size_t k = 0; k < result.variables.size(); ++k) {
    const DesignVariable& v = result.variables[k];
    const Eigen::Index row = static_cast<Eigen::Index>(k);
    const double z = found.of_bounds(row);
    if (std::abs(z) <= kNoPrice) continue;
    result.conflicts.push_back(
        {limit_text(v.name, z > 0, z > 0 ? *v.upper : *v.lower), 0, std::abs(z) / std::abs(rho_x(row))});
  }
  std::string words;
  for (const DesignConflict& c : result.conflicts)
    words +=
        fmt::format("{}{} ({})", words.empty() ? "" : ", ", c.limit,
                    c.missed > 0 ? fmt::format("missed by {:.3g}", c.missed) : fmt::format("price {:.3g}", c.price));
  if (!words.empty()) result.message += "; in conflict: " + words;
}

// The values that are minimised case by case, and the true one that a smooth objective stands for.
void describe_objective(const DesignProgram& program, const std::vector<std::optional<double>>& true_values,
                        DesignResult& result) {
  if (!result.final_evaluation.ok) return;
  const CaseObjective& objective = program.objective();
  const double sign = program.spec().sign();
  const std::vector<Eigen::Index> rows = program.minimised_rows();
  const Eigen::VectorXd values = program.minimised(result.final_evaluation.psi);
  Eigen::VectorXd true_ones = values;
  bool smooth = false;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const std::optional<double>& true_value = true_values[static_cast<std::size_t>(rows[j])];
    smooth = smooth || true_value;
    true_ones(static_cast<Eigen::Index>(j)) = true_value.value_or(values(static_cast<Eigen::Index>(j)));
  }
  for (std::size_t c = 0; c < result.cases.size(); ++c) {
    result.cases[c].value = sign * objective.of_case(values, static_cast<Eigen::Index>(c));
    if (smooth) result.cases[c].true_value = sign * objective.of_case(true_ones, static_cast<Eigen::Index>(c));
  }
  for (std::size_t k = 0; k < result.terms.size(); ++k) {
    result.terms[k].value = values(static_cast<Eigen::Index>(k));
    result.terms[k].true_value = true_values[static_cast<std::size_t>(rows[k])];
  }
  if (smooth || objective.is_maximum()) result.objective_true = sign * objective.true_value(true_ones);
}

// Least squares converges by its steps. A solved run has no noise, so that its end must also satisfy the optimality
// conditions.
void judge_stationarity(const OptimizerSpec& optimizer, DesignResult& result) {
  const bool judged = optimizer.type == OptimizerSpec::kLeastSquares && result.final_evaluation.ok &&
                      result.final_evaluation.statistics.solved;
  if (!judged || result.status != SolverStatus::converged) return;
  if (result.optimality <= kSettled * optimizer.tolerance) return;
  result.end(SolverStatus::no_progress,
             fmt::format("no further progress: cost and parameters settle where the optimality is {:.1g}, a kink "
                         "or a dead point",
                         result.optimality));
}

// Says where a limit on an extreme does not hold for the true one.
void judge_true_extremes(const DesignProgram& program, DesignResult& result) {
  if (result.status == SolverStatus::infeasible) return;  // the conflicts name what is missed
  bool beyond = false;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    const DesignConstraint& c = result.constraints[i];
    const Extreme extreme = program.limited(static_cast<Eigen::Index>(i)).extreme();
    if (extreme == Extreme::none) continue;
    const char* const what = extreme == Extreme::maximum   ? "maximum"
                             : extreme == Extreme::minimum ? "minimum"
                                                           : "peak to peak value";
    const std::string place =
        fmt::format("design.subject_to[{}]: the {} of '{}'", i % program.spec().subject_to.size(), what, c.in_words());
    if (!c.true_value) {
      beyond = true;
      result.warnings.push_back(place +
                                " is held by its smooth value only; the run that was to find the true one failed");
      continue;
    }
    const bool equality = is_equality(c);
    const double tolerance = kTrueLimitTolerance * program.size(static_cast<Eigen::Index>(i));
    if (c.true_violation > (equality ? tolerance : 0)) {
      beyond = true;
      const bool above = c.upper && *c.true_value > *c.upper;
      result.warnings.push_back(
          fmt::format("{} is {:.6g}, {} the limit {:.6g}, though its smooth value is {:.6g}; more sharpness brings the "
                      "two together",
                      place, *c.true_value, above ? "above" : "below", above ? *c.upper : *c.lower, c.value));
    } else if (c.price != 0 && !equality && result.status == SolverStatus::converged) {
      const double bound = c.at_upper ? *c.upper : *c.lower, unused = std::abs(*c.true_value - bound);
      if (unused > tolerance)
        result.warnings.push_back(fmt::format(
            "{} is {:.6g}: the limit {:.6g} binds, but {:.2g} of it is unused, which the accuracy of the optimiser "
            "cannot tell from the limit; a smaller design.optimizer.tolerance may use more",
            place, *c.true_value, bound, unused));
    }
  }
  if (!beyond || result.status != SolverStatus::converged) return;
  result.status = SolverStatus::converged_beyond_limit;
  result.message += "; limits hold for smooth extremes only";
}

}  // namespace

void describe_start(const DesignProgram& program, const Evaluation& start, DesignResult& result) {
  const std::vector<CaseSpec>& cases = program.problem().cases;
  const DesignSpec& spec = program.spec();
  result.objective = spec.name();
  result.maximises = spec.sign() < 0;
  for (const Parameter& p : program.designed())
    result.variables.push_back({p.name, p.unit, p.value, p.value, p.lower, p.upper, false, false});
  const CaseObjective& objective = program.objective();
  const Eigen::VectorXd minimised =
      start.ok ? program.minimised(start.psi) : Eigen::VectorXd::Zero(objective.weights().size());
  if (start.ok) result.objective_initial = result.objective_final = spec.sign() * objective.value(minimised);
  for (std::size_t c = 0; c < cases.size(); ++c) {
    const double value = spec.sign() * objective.of_case(minimised, static_cast<Eigen::Index>(c));
    result.cases.push_back({cases[c].name, cases[c].weight, value, value});
  }
  if (cases.empty() && spec.terms().size() > 1)
    for (const WeightedObjective& term : spec.terms()) {
      const double value = minimised(static_cast<Eigen::Index>(result.terms.size()));
      result.terms.push_back({term.objective, term.weight, value, value});
    }
  for (Eigen::Index i = 0; i < program.constraints(); ++i) {
    const ObjectiveBound& bound = program.bound(i);
    DesignConstraint& constraint = result.constraints.emplace_back();
    constraint.objective = bound.objective;
    constraint.lower = bound.lower;
    constraint.upper = bound.upper;
    constraint.initial = constraint.value = start.ok ? start.psi(program.psi_of(i)) : 0;
    constraint.load_case =
        program.evaluator().case_name(static_cast<std::size_t>(i) / program.spec().subject_to.size());
  }
  if (start.ok && start.has_gradients()) warn_of_idle_variables(start, spec, result);
}

void describe_end(const DesignProgram& program, const NlpResult& solution, DesignResult& result) {
  const NlpPoint& end = solution.point;
  const Eigen::VectorXd rho_x = program.scaling().rho_x(solution.x);  // how large the optimiser takes the variables
  for (std::size_t k = 0; k < result.variables.size(); ++k) {
    DesignVariable& v = result.variables[k];
    v.value = result.rho(program.evaluator().variables()[k]);
    const double width = v.lower && v.upper ? *v.upper - *v.lower : INFINITY;
    const double size = std::min(width, kWide * rho_x(static_cast<Eigen::Index>(k)));
    v.at_lower = touches(v.value, v.lower, size);
    v.at_upper = touches(v.value, v.upper, size);
  }
  result.objective_final = program.spec().sign() * end.f;
  result.violation = result.true_violation = program.violation(end.c);
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    c.value = end.c(row) * program.size(row);
    c.violation = missed(c, c.value);
    c.at_lower = c.lower && touches(end.c(row), program.c_lower(row), 1);
    c.at_upper = c.upper && touches(end.c(row), program.c_upper(row), 1);
  }
}

void describe_solution(DesignProgram& program, const Eigen::VectorXd& x, DesignResult& result) {
  const std::vector<std::optional<double>> true_values = program.evaluator().true_values(result.rho);
  result.final_evaluation = program.evaluation(result.rho);
  describe_objective(program, true_values, result);
  result.true_violation = 0;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    c.true_value = true_values[static_cast<std::size_t>(program.psi_of(static_cast<Eigen::Index>(i)))];
    c.true_violation = missed(c, c.true_value.value_or(c.value));
    if (c.true_value) c.violation = c.true_violation;
    result.true_violation =
        std::max(result.true_violation, c.true_violation / program.size(static_cast<Eigen::Index>(i)));
  }
  NlpPoint end;
  end.f_x.setZero(program.variables());
  end.c.setZero(program.constraints());
  end.c_x.setZero(program.constraints(), program.variables());
  program.evaluate(x, end);
  if (!end.ok) return;
  const Stationarity found = stationarity(program, x, end);
  result.optimality = found.distance;
  for (std::size_t i = 0; i < result.constraints.size(); ++i) {
    DesignConstraint& c = result.constraints[i];
    const Eigen::Index row = static_cast<Eigen::Index>(i);
    const double fall = found.multipliers(row) * program.c_scale(row) / (program.f_scale * program.size(row));
    const bool equality = is_equality(c), binds = found.binds(row, program.spec().optimizer.tolerance);
    c.price = equality ? fall : binds ? std::abs(fall) : 0;
    c.at_lower = c.at_lower || (binds && fall < 0);
    c.at_upper = c.at_upper || (binds && fall > 0);
  }
  if (result.status == SolverStatus::infeasible) describe_conflict(program, x, end, result);
}

void judge_solution(const DesignProgram& program, DesignResult& result) {
  judge_stationarity(program.spec().optimizer, result);
  judge_true_extremes(program, result);
}

}  // namespace mbsopt::inline optim
