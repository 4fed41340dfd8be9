#include "optim/design/design_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "optim/objective/design_issues.hpp"
#include "optim/objective/gauss_newton.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/problem/bounded_means.hpp"
#include "optim/solver/nlopt_solver.hpp"
#include "optim/solver/nlp_search.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A limit on a true extreme is moved inside by this part of its size: another look at the run may find a larger one.
constexpr double kInsideExtremes = 5e-7;

double inverse(double x) { return x > 0 && std::isfinite(x) ? 1 / x : 1; }

// A step of an interior point method needs no more than this of a Hessian; a shorter ladder is a cheaper one. Gradients
// are exact, so differences may be short. They have to be: the gradient of a wild motion changes its sign within 1e-4
// of a length.
HessianOptions for_steps() {
  HessianOptions options;
  options.relative_step = 1e-5;
  options.rungs = 8;
  options.enough = 1e-4;
  return options;
}

const DesignSpec& checked(const Problem& problem) {
  if (!problem.design) throw std::invalid_argument("design: is missing; it says what to minimise and what to vary");
  const DesignSpec& spec = *problem.design;
  if (spec.variables.empty()) throw std::invalid_argument("design.variables: is empty; name at least one parameter");
  const bool is_known = spec.optimizer.is_sqp() || spec.optimizer.asks_for_ipopt() ||
                        spec.optimizer.type == OptimizerSpec::kLeastSquares || find_nlopt_method(spec.optimizer.type);
  if (!is_known)
    throw std::invalid_argument(fmt::format("design.optimizer.type: is '{}'; available: auto sqp ipopt {} {}",
                                            spec.optimizer.type, OptimizerSpec::kLeastSquares, nlopt_method_names()));
  for (std::size_t i = 0; i < spec.subject_to.size(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[i];
    if (!bound.lower && !bound.upper)
      throw std::invalid_argument(fmt::format("design.subject_to[{}]: gives neither lower nor upper", i));
    if (bound.lower && bound.upper && *bound.lower > *bound.upper)
      throw std::invalid_argument(
          fmt::format("design.subject_to[{}]: lower is {}, above upper {}", i, *bound.lower, *bound.upper));
  }
  if (const std::vector<SceneIssue> issues = optimizer_issues(spec, problem.scene); !issues.empty())
    throw std::invalid_argument(issues[0].path + ": " + issues[0].message);
  if (const std::optional<SceneIssue> issue = curvature_issue(problem))
    throw std::invalid_argument(issue->path + ": " + issue->message);
  return spec;
}

// Names bounded means. Least squares takes no limits; sqp, with Gauss-Newton's matrix of the squares, does.
Problem prepared(Problem problem) {
  name_bounded_means(problem);
  if (problem.design && problem.design->optimizer.type == OptimizerSpec::kLeastSquares &&
      !problem.design->subject_to.empty())
    problem.design->optimizer.type = OptimizerSpec::kAutomatic;
  return problem;
}

EvaluatorOptions evaluator_options(const DesignSpec& spec, const DesignOptions& options) {
  EvaluatorOptions result;
  result.true_extremes = spec.optimizer.is_sqp();
  result.method = options.method;
  result.user_forces = options.user_forces;
  result.threads = options.threads;
  result.progress = options.simulation_progress;
  return result;
}

}  // namespace

// Whether Gauss-Newton's matrix tells more of the objective than nothing.
bool sums_squares(const Problem& problem, const DesignSpec& spec, const Evaluator& evaluator) {
  if (!spec.optimizer.is_sqp() || is_cvodes(problem.scene.simulation.integrator.type)) return false;
  if (spec.minimize.empty() || (spec.over == "max" && problem.cases.size() > 1)) return false;
  for (std::size_t c = 0; c < evaluator.cases(); ++c) {
    const Objective& objective = evaluator.of_case(c).objectives()[0];
    if (objective.is_extreme() || objective.is_linear() || objective.is_of_linear_motion() ||
        objective.is_written_in_cpp() || objective.free_instants())
      return false;
  }
  return true;
}

std::vector<std::string> objective_names(const DesignSpec& spec) {
  std::vector<std::string> names;
  for (const WeightedObjective& term : spec.terms()) names.push_back(term.objective);
  for (const ObjectiveBound& bound : spec.subject_to) names.push_back(bound.objective);
  return names;
}

DesignProgram::DesignProgram(const Problem& problem, const DesignOptions& options, std::function<bool()> abandoned)
    : NonlinearProgram(0, 0),
      problem_(prepared(problem)),
      spec_(checked(problem_)),
      evaluator_(problem_, objective_names(spec_), spec_.variables, evaluator_options(spec_, options)),
      scaling_(designed(), felt_changes()),
      x_start_(scaling_.to_x(evaluator_.start()(evaluator_.variables()))),
      terms_(static_cast<Index>(spec_.terms().size())),
      bounds_(static_cast<Index>(spec_.subject_to.size())),
      abandoned_(std::move(abandoned)),
      has_squares_(sums_squares(problem_, spec_, evaluator_)),
      gauss_newton_(has_squares_ || spec_.optimizer.hessian == "gauss_newton") {
  if (has_squares_) evaluator_.gather_curvature();
  x_lower = scaling_.x_lower();
  x_upper = scaling_.x_upper();
  objective_ = CaseObjective(problem_.cases, spec_);
  if (!spec_.sharpness && !spec_.optimizer.is_sqp()) {
    spec_.sharpness = sharpness();
    objective_ = CaseObjective(problem_.cases, spec_);
  }
  const Index m = bounds_ * static_cast<Index>(evaluator_.cases());
  c_lower.setConstant(m, -kInfinity);
  c_upper.setConstant(m, kInfinity);
  c_scale.setOnes(m);
  size_.setOnes(m);
  for (Index i = 0; i < m; ++i) {
    const double size = std::max(std::abs(bound(i).lower.value_or(0)), std::abs(bound(i).upper.value_or(0)));
    if (size > 0) size_(i) = size;
    c_lower(i) = bound(i).lower.value_or(-kInfinity) / size_(i);
    c_upper(i) = bound(i).upper.value_or(kInfinity) / size_(i);
    if (spec_.optimizer.is_sqp() && limited(i).is_extreme() && c_lower(i) < c_upper(i)) {
      c_lower(i) += kInsideExtremes;
      c_upper(i) -= kInsideExtremes;
    }
  }
}

std::vector<Parameter> DesignProgram::designed() const {
  std::vector<Parameter> parameters;
  for (const int k : evaluator_.variables())
    parameters.push_back(problem_.scene.parameters[static_cast<std::size_t>(k)]);
  return parameters;
}

// Per variable the change d that alters an objective or a limit by its size:
//   |g| d + |h| d^2/2 = |psi|      g: slope at the start, h: its change along a short step of all these variables
// Empty if all values tell how large their variables are. Where h is not known, values tell that unless they are 0. Of
// an extreme h is taken as 0: another peak may become the largest on the way.
VectorXd DesignProgram::felt_changes() {
  constexpr double kShort = 1e-3, kShortOfRange = 1e-8;  // of the value; of a range, which may be far too wide
  const std::vector<Parameter> variables = designed();
  const std::vector<int>& indices = evaluator_.variables();
  if (std::ranges::none_of(variables, is_scaled_by_range)) return {};
  const Evaluation start = evaluator_.gradients(evaluator_.start());
  if (!start.ok) return {};
  const auto alters = [&](Index i, Index k, double h) {
    const double size = std::abs(start.psi(i)), g = std::abs(start.psi_rho(i, k));
    return size > 0 && g + h > 0 ? 2 * size / (g + std::sqrt(g * g + 2 * h * size)) : kInfinity;
  };
  VectorXd beside = evaluator_.start();
  for (std::size_t k = 0; k < variables.size(); ++k) {
    const Parameter& p = variables[k];
    if (!is_scaled_by_range(p)) continue;
    double least = kInfinity;
    for (Index i = 0; i < start.psi.size(); ++i) least = std::min(least, alters(i, static_cast<Index>(k), 0));
    const double range = p.lower && p.upper ? *p.upper - *p.lower : kInfinity;
    const double of_range = std::isfinite(range) ? kShortOfRange * range : kShort;
    const double step = p.value != 0           ? kShort * std::abs(p.value)
                        : std::isfinite(least) ? std::max(of_range, kShort * std::min(least, range))
                                               : of_range;
    beside(indices[k]) += p.upper && p.value + step > *p.upper ? -step : step;
  }
  const Evaluation there = evaluator_.gradients(beside);
  const std::vector<Objective>& objectives = evaluator_.of_case(0).objectives();  // psi lists them case by case
  VectorXd felt(start.psi_rho.cols());
  for (Index k = 0; k < felt.size(); ++k) {
    const int index = indices[static_cast<std::size_t>(k)];
    const double step = beside(index) - start.rho(index);
    felt(k) = there.ok || start.rho(index) == 0 ? kInfinity : 0;
    for (Index i = 0; i < start.psi.size(); ++i) {
      const bool is_extreme = objectives[static_cast<std::size_t>(i) % objectives.size()].is_extreme();
      const double bend = there.psi_rho.size() > 0 ? there.psi_rho(i, k) - start.psi_rho(i, k) : 0;
      felt(k) = std::min(felt(k), alters(i, k, there.ok && step != 0 && !is_extreme ? std::abs(bend / step) : 0));
    }
  }
  return felt;
}

// The sharpness of the maximum over cases and terms is relative to the largest value at the start.
std::optional<double> DesignProgram::sharpness() {
  if (!objective_.is_maximum()) return std::nullopt;
  const Evaluation start = evaluator_.gradients(evaluator_.start());
  const double largest = start.ok ? objective_.weights().cwiseProduct(minimised(start.psi)).cwiseAbs().maxCoeff() : 0;
  return DesignSpec::kSharpness / (largest > 0 ? largest : 1);
}

std::vector<Index> DesignProgram::minimised_rows() const {
  std::vector<Index> rows;
  for (Index c = 0; c < static_cast<Index>(evaluator_.cases()); ++c)
    for (Index k = 0; k < terms_; ++k) rows.push_back(c * (terms_ + bounds_) + k);
  return rows;
}
Index DesignProgram::psi_of(Index constraint) const {
  return constraint / bounds_ * (terms_ + bounds_) + terms_ + constraint % bounds_;
}
const Objective& DesignProgram::limited(Index constraint) const {
  return evaluator_.of_case(static_cast<std::size_t>(constraint / bounds_))
      .objectives()[static_cast<std::size_t>(terms_ + constraint % bounds_)];
}
const ObjectiveBound& DesignProgram::bound(Index constraint) const {
  return spec_.subject_to[static_cast<std::size_t>(constraint % bounds_)];
}

VectorXd DesignProgram::minimised(const VectorXd& psi) const { return psi(minimised_rows()); }

VectorXd DesignProgram::f_rho(const Evaluation& e) const {
  return e.psi_rho(minimised_rows(), Eigen::all).transpose() * objective_.gradient(minimised(e.psi));
}

NlpScale DesignProgram::scale_at(const VectorXd& x_start) {
  constexpr double kLittleWay = 0.01;
  const VectorXd shift = kLittleWay * x_start.cwiseAbs().cwiseMax(1);
  VectorXd inward = x_start + shift;
  for (Index k = 0; k < inward.size(); ++k)
    if (inward(k) > x_upper(k)) inward(k) = std::max(x_start(k) - shift(k), x_lower(k));
  double f_size = 0;
  VectorXd c_size = VectorXd::Zero(constraints());
  for (const VectorXd& x : {inward, x_start}) {  // the start last: it is kept
    NlpPoint point;
    point.f_x.setZero(variables());
    point.c.setZero(constraints());
    point.c_x.setZero(constraints(), variables());
    evaluate(x, point);
    if (!point.ok) continue;
    f_size = std::max({f_size, std::abs(point.f), point.f_x.cwiseAbs().maxCoeff()});
    c_size = c_size.cwiseMax(point.c_x.cwiseAbs().rowwise().maxCoeff());
  }
  return {inverse(f_size), c_size.unaryExpr([](double size) { return std::min(1.0, inverse(size)); })};
}

Evaluation DesignProgram::start_from(const VectorXd& x_start, const std::optional<NlpScale>& given) {
  scale_ = given ? *given : scale_at(x_start);
  f_scale = scale_.f;
  c_scale = scale_.c;
  for (Index i = 0; i < constraints(); ++i) {
    if (bound(i).lower.value_or(0) != 0 || bound(i).upper.value_or(0) != 0) continue;
    size_(i) = 1 / c_scale(i);  // bounds of 0 have no size; this is what variables of size 1 alter
    c_scale(i) = 1;
  }
  const Evaluation start = evaluator_.gradients(rho_at(x_start));  // in memory, unless the scale is given
  if (start.ok) {
    best_ = start;
    best_f_ = objective_.value(minimised(start.psi));
    best_violations_ = violations_of(start);
  }
  return start;
}

double DesignProgram::violations_of(const Evaluation& e) const {
  VectorXd c(constraints());
  for (Index i = 0; i < constraints(); ++i) c(i) = e.psi(psi_of(i)) / size_(i);
  return sum_of_violations(c, kConstraintTolerance);
}

VectorXd DesignProgram::rho_at(const VectorXd& x) const {
  VectorXd rho = evaluator_.start();  // which parameters that are not designed keep
  rho(evaluator_.variables()) = scaling_.to_rho(x);
  return rho;
}

// Into the point: values, and derivatives where it has room for them. Keeps the evaluation if it is the best.
void DesignProgram::fill(const Evaluation& e, const VectorXd& x, NlpPoint& point) {
  if (!e.ok) {
    point.ok = false;
    point.message = e.message;
    point.abandoned = abandoned_ && abandoned_();
    return;
  }
  point.f = objective_.value(minimised(e.psi));
  for (Index i = 0; i < constraints(); ++i) point.c(i) = e.psi(psi_of(i)) / size_(i);
  if (point.f_x.size() > 0) {
    const VectorXd rho_x = scaling_.rho_x(x);
    point.f_x = f_rho(e).cwiseProduct(rho_x);
    for (Index i = 0; i < constraints(); ++i)
      point.c_x.row(i) = e.psi_rho.row(psi_of(i)).cwiseProduct(rho_x.transpose()) / size_(i);
    add_pieces(e, rho_x, point);
  }
  const double violations = violations_of(e);
  if (best_.ok && !is_better(point.f, violations, best_f_, best_violations_)) return;
  best_ = e;
  best_f_ = point.f;
  best_violations_ = violations;
}

// A sum over cases and terms has an extreme for each of them; their maximum has one, of the pieces of all.
void DesignProgram::add_pieces(const Evaluation& e, const VectorXd& rho_x, NlpPoint& point) const {
  const Index stride = terms_ + bounds_;
  const bool is_maximum = objective_.is_true_maximum();
  const auto apart = [](Index c) { return 1e3 * static_cast<double>(c); };
  std::vector<NlpPiece> of_maximum;
  const std::vector<Index> rows = minimised_rows();
  std::vector<bool> has_pieces(rows.size(), false);
  const VectorXd weights = is_maximum ? objective_.weights() : objective_.gradient(minimised(e.psi));
  for (const ExtremePiece& piece : e.pieces) {
    const Index c = piece.row / stride, k = piece.row % stride;
    const VectorXd gradient = piece.gradient.cwiseProduct(rho_x);
    if (k >= terms_) {
      const Index constraint = c * bounds_ + k - terms_;
      point.pieces.push_back(
          {constraint, piece.side, piece.value / size_(constraint), gradient / size_(constraint), piece.t});
      continue;
    }
    const Index j = c * terms_ + k;
    const double weight = weights(j);
    if (piece.side * weight < 0) continue;  // the least of several: a search that lowers it sees one of them
    has_pieces[static_cast<std::size_t>(j)] = true;
    const NlpPiece of_f{is_maximum ? NlpPiece::kObjective : NlpPiece::kObjective - j, 1, weight * piece.value,
                        weight * gradient, piece.t + apart(j)};
    (is_maximum ? of_maximum : point.pieces).push_back(of_f);
  }
  if (!is_maximum) return;
  for (Index j = 0; j < weights.size(); ++j) {
    const Index row = rows[static_cast<std::size_t>(j)];
    if (!has_pieces[static_cast<std::size_t>(j)])
      of_maximum.push_back({NlpPiece::kObjective, 1, weights(j) * e.psi(row),
                            weights(j) * e.psi_rho.row(row).transpose().cwiseProduct(rho_x), apart(j)});
  }
  std::ranges::stable_sort(of_maximum, std::greater(), &NlpPiece::value);
  std::ranges::move(of_maximum, std::back_inserter(point.pieces));
}

void DesignProgram::evaluate(const VectorXd& x, NlpPoint& point) { fill(evaluation(rho_at(x)), x, point); }

void DesignProgram::evaluate_values(const VectorXd& x, NlpPoint& point) {
  const VectorXd rho = rho_at(x);
  fill(best_.ok && best_.rho == rho ? best_ : evaluator_.values(rho), x, point);
}

Evaluation DesignProgram::evaluation(const VectorXd& rho) {
  return best_.ok && best_.has_gradients() && best_.rho == rho ? best_ : evaluator_.gradients(rho);
}

// Hessians of the evaluator's objectives, case by case, exact or by Gauss-Newton.
bool DesignProgram::second_derivatives(const Evaluation& at, std::vector<MatrixXd>& psi_rhorho) {
  std::vector<Hessians> found(evaluator_.cases());
  evaluator_.for_each_case([&](std::size_t c) {
    Evaluator& evaluator = evaluator_.of_case(c);
    found[c] = gauss_newton_ ? gauss_newton(evaluator, at.of_case(c), has_squares_ ? 1 : 0)
                             : mbsopt::hessians(evaluator, at.rho, for_steps());
  });
  bool ok = true;
  for (Hessians& of_case : found) {
    if (!of_case.ok && hessian_failure_.empty()) hessian_failure_ = of_case.message;
    ok = ok && of_case.ok;
    hessian_gradients_ += of_case.gradients;
    for (ObjectiveHessian& H : of_case.of) psi_rhorho.push_back(std::move(H.value));
  }
  return ok;
}

bool DesignProgram::hessians(const VectorXd& x, std::vector<MatrixXd>& H) {
  const VectorXd rho_x = scaling_.rho_x(x), rho_xx = scaling_.rho_xx(x);
  const Evaluation at = evaluation(rho_at(x));
  std::vector<MatrixXd> psi_rhorho;
  if (!second_derivatives(at, psi_rhorho)) return false;
  const auto of_psi = [&](Index row) -> MatrixXd& { return psi_rhorho[static_cast<std::size_t>(row)]; };
  const auto in_x = [&](const MatrixXd& of_rho, const VectorXd& gradient) {
    MatrixXd of_x = rho_x.asDiagonal() * of_rho * rho_x.asDiagonal();
    if (!gauss_newton_) of_x.diagonal() += gradient.cwiseProduct(rho_xx);
    return of_x;
  };
  // f_rhorho = sum of f_psi psi_rhorho + psi_rho' f_psipsi psi_rho
  const VectorXd psi = minimised(at.psi), slopes = objective_.gradient(psi);
  if (has_squares_) {
    MatrixXd squares = MatrixXd::Zero(x.size(), x.size());
    for (Index c = 0; c < slopes.size(); ++c) squares += slopes(c) * of_psi(c);
    H = {in_x(squares, f_rho(at))};
    return true;
  }
  const std::vector<Index> rows = minimised_rows();
  MatrixXd f_rhorho = MatrixXd::Zero(x.size(), x.size());
  for (Index j = 0; j < slopes.size(); ++j) f_rhorho += slopes(j) * of_psi(rows[static_cast<std::size_t>(j)]);
  if (objective_.is_maximum()) {
    const MatrixXd psi_rho = at.psi_rho(rows, Eigen::all);
    f_rhorho += psi_rho.transpose() * objective_.hessian(psi) * psi_rho;
  }
  H = {in_x(f_rhorho, f_rho(at))};
  for (Index i = 0; i < constraints(); ++i)
    H.push_back(in_x(of_psi(psi_of(i)), at.psi_rho.row(psi_of(i)).transpose()) / size_(i));
  return true;
}

}  // namespace mbsopt::inline optim
