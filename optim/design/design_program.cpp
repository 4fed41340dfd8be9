#include "optim/design/design_program.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/objective/gauss_newton.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/solver/nlp_search.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double inverse(double x) { return x > 0 && std::isfinite(x) ? 1 / x : 1; }

// A step of an interior point method needs no more than this of a Hessian; a shorter ladder is a cheaper one. Gradients
// are exact, so differences may be short. They have to be: the gradient of a wild motion changes its sign within 1e-4
// of a length.
HessianOptions for_steps() {
  HessianOptions options;
  options.relative_step = 1e-5, options.rungs = 8, options.enough = 1e-4;
  return options;
}

}  // namespace

DesignProgram::DesignProgram(const DesignSpec& spec, CaseEvaluator& evaluator, const VariableScaling& scaling,
                             CaseObjective objective, std::function<bool()> abandoned)
    : NonlinearProgram(scaling.size(), static_cast<Index>(spec.subject_to.size() * evaluator.cases())),
      evaluator_(evaluator),
      objective_(std::move(objective)),
      bounds_(static_cast<Index>(spec.subject_to.size())),
      scaling_(scaling),
      abandoned_(std::move(abandoned)),
      rho_(evaluator.start()),
      size_(constraints()),
      gauss_newton_(spec.optimizer.hessian == "gauss_newton") {
  x_lower = scaling.x_lower(), x_upper = scaling.x_upper();
  for (Index i = 0; i < constraints(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[static_cast<std::size_t>(i % bounds_)];
    size_(i) = std::max(std::abs(bound.lower.value_or(0)), std::abs(bound.upper.value_or(0)));
    if (size_(i) == 0) size_(i) = 1;
    if (bound.lower) c_lower(i) = *bound.lower / size_(i);
    if (bound.upper) c_upper(i) = *bound.upper / size_(i);
  }
}

Index DesignProgram::row_of(std::size_t load_case) const { return static_cast<Index>(load_case) * (1 + bounds_); }
Index DesignProgram::psi_of(Index constraint) const {
  return row_of(static_cast<std::size_t>(constraint / bounds_)) + 1 + constraint % bounds_;
}

VectorXd DesignProgram::minimised(const VectorXd& psi) const { return psi(Eigen::seq(0, psi.size() - 1, 1 + bounds_)); }

VectorXd DesignProgram::f_rho(const Evaluation& e) const {
  const VectorXd slopes = objective_.gradient(minimised(e.psi));
  VectorXd sum = VectorXd::Zero(e.psi_rho.cols());
  for (std::size_t c = 0; c < evaluator_.cases(); ++c)
    sum += slopes(static_cast<Index>(c)) * e.psi_rho.row(row_of(c)).transpose();
  return sum;
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
    point.f_x.setZero(variables()), point.c.setZero(constraints()), point.c_x.setZero(constraints(), variables());
    evaluate(x, point);
    if (!point.ok) continue;
    f_size = std::max({f_size, std::abs(point.f), point.f_x.cwiseAbs().maxCoeff()});
    c_size = c_size.cwiseMax(point.c_x.cwiseAbs().rowwise().maxCoeff());
  }
  return {inverse(f_size), c_size.unaryExpr([](double size) { return std::min(1.0, inverse(size)); })};
}

CaseEvaluation DesignProgram::start_from(const VectorXd& x_start, const std::optional<NlpScale>& given) {
  const NlpScale scale = given ? *given : scale_at(x_start);
  f_scale = scale.f, c_scale = scale.c;
  const CaseEvaluation start = evaluator_.gradients(rho_at(x_start));  // in memory, unless the scale is given
  if (start.ok)
    best_ = start, best_f_ = objective_.value(minimised(start.psi)), best_violations_ = violations_of(start);
  return start;
}

void DesignProgram::set_bounds(Index constraint, const std::optional<double>& lower,
                               const std::optional<double>& upper) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  c_lower(constraint) = lower.value_or(-kNone) / size_(constraint);
  c_upper(constraint) = upper.value_or(kNone) / size_(constraint);
  if (best_.ok) best_violations_ = violations_of(best_);
}

double DesignProgram::violations_of(const Evaluation& e) const {
  VectorXd c(constraints());
  for (Index i = 0; i < constraints(); ++i) c(i) = e.psi(psi_of(i)) / size_(i);
  return sum_of_violations(c, kConstraintTolerance);
}

VectorXd DesignProgram::rho_at(const VectorXd& x) const {
  VectorXd rho = rho_;
  const VectorXd values = scaling_.to_rho(x);
  for (Index k = 0; k < values.size(); ++k) rho(evaluator_.variables()[static_cast<std::size_t>(k)]) = values(k);
  return rho;
}

// Into the point: values, and derivatives where it has room for them.
void DesignProgram::fill(const CaseEvaluation& e, const VectorXd& x, NlpPoint& point) const {
  if (!e.ok) {
    point.ok = false, point.message = e.message;
    point.abandoned = abandoned_ && abandoned_();
    return;
  }
  point.f = objective_.value(minimised(e.psi));
  for (Index i = 0; i < constraints(); ++i) point.c(i) = e.psi(psi_of(i)) / size_(i);
  if (point.f_x.size() == 0) return;
  const VectorXd rho_x = scaling_.rho_x(x);
  point.f_x = f_rho(e).cwiseProduct(rho_x);
  for (Index i = 0; i < constraints(); ++i)
    point.c_x.row(i) = e.psi_rho.row(psi_of(i)).cwiseProduct(rho_x.transpose()) / size_(i);
}

void DesignProgram::keep(const CaseEvaluation& e) {
  if (!e.ok || &e == &best_) return;
  const double f = objective_.value(minimised(e.psi)), now = violations_of(e);
  if (best_.ok && !is_better(f, now, best_f_, best_violations_)) return;
  best_ = e, best_f_ = f, best_violations_ = now;
}

void DesignProgram::evaluate(const VectorXd& x, NlpPoint& point) {
  const CaseEvaluation& e = evaluation(rho_at(x));
  fill(e, x, point);
  keep(e);
}

void DesignProgram::evaluate_values(const VectorXd& x, NlpPoint& point) {
  const VectorXd rho = rho_at(x);
  const CaseEvaluation& e = best_.ok && best_.rho == rho ? best_ : evaluator_.values(rho);
  fill(e, x, point);
  keep(e);
}

CaseEvaluation DesignProgram::evaluation(const VectorXd& rho) {
  return best_.ok && best_.has_gradients() && best_.rho == rho ? best_ : evaluator_.gradients(rho);
}

// Hessians of the evaluator's objectives, case by case, exact or by Gauss-Newton.
bool DesignProgram::second_derivatives(const VectorXd& rho, std::vector<MatrixXd>& psi_rhorho) {
  struct Found {
    bool ok = false;
    std::string message;
    std::vector<MatrixXd> of;
    long gradients = 1;
  };
  std::vector<Found> found(evaluator_.cases());
  const CaseEvaluation at = evaluation(rho);
  evaluator_.for_each_case([&](std::size_t c) {
    if (gauss_newton_) {
      const Evaluation& e = at.of_cases[c];
      GaussNewton H = e.ok ? gauss_newton(evaluator_.of_case(c), e) : GaussNewton{false, e.message, {}};
      found[c] = {H.ok, H.message, std::move(H.of)};
      return;
    }
    const Hessians H = mbsopt::hessians(evaluator_.of_case(c), rho, for_steps());
    found[c] = {H.ok, H.message, {}, H.gradients};
    for (const ObjectiveHessian& of : H.of) found[c].of.push_back(of.value);
  });
  bool ok = true;
  for (Found& of_case : found) {
    if (!of_case.ok && hessian_failure_.empty()) hessian_failure_ = of_case.message;
    ok = ok && of_case.ok;
    hessian_gradients_ += of_case.gradients;
    for (MatrixXd& H : of_case.of) psi_rhorho.push_back(std::move(H));
  }
  return ok;
}

bool DesignProgram::hessians(const VectorXd& x, std::vector<MatrixXd>& H) {
  const VectorXd rho_x = scaling_.rho_x(x), rho_xx = scaling_.rho_xx(x), rho = rho_at(x);
  std::vector<MatrixXd> psi_rhorho;
  if (!second_derivatives(rho, psi_rhorho)) return false;
  const CaseEvaluation at = evaluation(rho);  // of Gauss-Newton rho(x) is a part of the motion
  const auto of_psi = [&](Index row) -> MatrixXd& { return psi_rhorho[static_cast<std::size_t>(row)]; };
  const auto in_x = [&](const MatrixXd& of_rho, const VectorXd& gradient) {
    MatrixXd of_x = rho_x.asDiagonal() * of_rho * rho_x.asDiagonal();
    if (!gauss_newton_) of_x.diagonal() += gradient.cwiseProduct(rho_xx);
    return of_x;
  };
  // f_rhorho = sum of f_psi psi_rhorho + psi_rho' f_psipsi psi_rho
  const VectorXd psi = minimised(at.psi), slopes = objective_.gradient(psi);
  MatrixXd f_rhorho = slopes(0) * of_psi(0);
  for (std::size_t c = 1; c < evaluator_.cases(); ++c) f_rhorho += slopes(static_cast<Index>(c)) * of_psi(row_of(c));
  if (objective_.is_maximum()) {
    const MatrixXd psi_rho = at.psi_rho(Eigen::seq(0, at.psi.size() - 1, 1 + bounds_), Eigen::all);
    f_rhorho += psi_rho.transpose() * objective_.hessian(psi) * psi_rho;
  }
  H = {in_x(f_rhorho, f_rho(at))};
  for (Index i = 0; i < constraints(); ++i)
    H.push_back(in_x(of_psi(psi_of(i)), at.psi_rho.row(psi_of(i)).transpose()) / size_(i));
  return true;
}

}  // namespace mbsopt::inline optim
