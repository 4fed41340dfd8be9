#include "optim/design/design_program.hpp"

#include <algorithm>
#include <cmath>

#include "optim/objective/gauss_newton.hpp"
#include "optim/objective/hessian.hpp"
#include "optim/solver/evaluated_points.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double inverse(double x) { return x > 0 && std::isfinite(x) ? 1 / x : 1; }

// A step of an interior point method needs no more than this of a Hessian; a shorter ladder is a cheaper one. Gradients
// are exact, so differences may be short, and have to be: the gradient of a wild motion changes its sign within 1e-4 of
// a length.
HessianOptions for_steps() {
  HessianOptions options;
  options.relative_step = 1e-5, options.rungs = 8, options.enough = 1e-4;
  return options;
}

}  // namespace

DesignProgram::DesignProgram(const DesignSpec& spec, Evaluator& evaluator, const VariableScaling& scaling,
                             std::function<bool()> abandoned)
    : NonlinearProgram(scaling.size(), static_cast<Index>(spec.subject_to.size())),
      evaluator_(evaluator),
      scaling_(scaling),
      abandoned_(std::move(abandoned)),
      rho_(evaluator.start()),
      size_(constraints()),
      gauss_newton_(spec.optimizer.hessian == "gauss_newton") {
  x_lower = scaling.x_lower(), x_upper = scaling.x_upper();
  for (Index i = 0; i < constraints(); ++i) {
    const ObjectiveBound& bound = spec.subject_to[static_cast<std::size_t>(i)];
    size_(i) = std::max(std::abs(bound.lower.value_or(0)), std::abs(bound.upper.value_or(0)));
    if (size_(i) == 0) size_(i) = 1;
    if (bound.lower) c_lower(i) = *bound.lower / size_(i);
    if (bound.upper) c_upper(i) = *bound.upper / size_(i);
  }
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

Evaluation DesignProgram::start_from(const VectorXd& x_start, const std::optional<NlpScale>& given) {
  const NlpScale scale = given ? *given : scale_at(x_start);
  f_scale = scale.f, c_scale = scale.c;
  const Evaluation start = evaluator_.gradients(rho_at(x_start));  // in memory, unless the scale is given
  if (start.ok) best_ = start, best_f_ = start.psi(0), best_violation_ = violation_of(start);
  return start;
}

void DesignProgram::set_bounds(Index constraint, const std::optional<double>& lower,
                               const std::optional<double>& upper) {
  if (lower) c_lower(constraint) = *lower / size_(constraint);
  if (upper) c_upper(constraint) = *upper / size_(constraint);
  if (best_.ok) best_violation_ = violation_of(best_);
}

double DesignProgram::violation_of(const Evaluation& e) const {
  VectorXd c(constraints());
  for (Index i = 0; i < constraints(); ++i) c(i) = e.psi(1 + i) / size_(i);
  return violation(c);
}

VectorXd DesignProgram::rho_at(const VectorXd& x) const {
  VectorXd rho = rho_;
  const VectorXd values = scaling_.to_rho(x);
  for (Index k = 0; k < values.size(); ++k) rho(evaluator_.variables()[static_cast<std::size_t>(k)]) = values(k);
  return rho;
}

// Into the point: values, and derivatives where it has room for them.
void DesignProgram::fill(const Evaluation& e, const VectorXd& x, NlpPoint& point) const {
  if (!e.ok) {
    point.ok = false, point.message = e.message;
    point.abandoned = abandoned_ && abandoned_();
    return;
  }
  point.f = e.psi(0);
  for (Index i = 0; i < constraints(); ++i) point.c(i) = e.psi(1 + i) / size_(i);
  if (point.f_x.size() == 0) return;
  const VectorXd rho_x = scaling_.rho_x(x);
  point.f_x = e.psi_rho.row(0).transpose().cwiseProduct(rho_x);
  for (Index i = 0; i < constraints(); ++i)
    point.c_x.row(i) = e.psi_rho.row(1 + i).cwiseProduct(rho_x.transpose()) / size_(i);
}

void DesignProgram::keep(const Evaluation& e) {
  if (!e.ok || &e == &best_) return;
  const double now = violation_of(e);
  if (best_.ok && !is_better(e.psi(0), now, best_f_, best_violation_, kConstraintTolerance)) return;
  best_ = e, best_f_ = e.psi(0), best_violation_ = now;
}

void DesignProgram::evaluate(const VectorXd& x, NlpPoint& point) {
  const Evaluation& e = evaluation(rho_at(x));
  fill(e, x, point);
  keep(e);
}

void DesignProgram::evaluate_values(const VectorXd& x, NlpPoint& point) {
  const VectorXd rho = rho_at(x);
  const Evaluation& e = best_.ok && best_.rho == rho ? best_ : evaluator_.values(rho);
  fill(e, x, point);
  keep(e);
}

const Evaluation& DesignProgram::evaluation(const VectorXd& rho) {
  return best_.ok && best_.has_gradients() && best_.rho == rho ? best_ : evaluator_.gradients(rho);
}

// Of the evaluator's objectives, exact or by Gauss-Newton.
bool DesignProgram::second_derivatives(const VectorXd& rho, std::vector<MatrixXd>& psi_rhorho) {
  std::string failure;
  bool ok = false;
  if (gauss_newton_) {
    const Evaluation at = evaluation(rho);
    GaussNewton found = at.ok ? gauss_newton(evaluator_, at) : GaussNewton{false, at.message, {}};
    ok = found.ok, failure = found.message, psi_rhorho = std::move(found.of);
    ++hessian_gradients_;
  } else {
    const Hessians found = mbsopt::hessians(evaluator_, rho, for_steps());
    ok = found.ok, failure = found.message;
    for (const ObjectiveHessian& H : found.of) psi_rhorho.push_back(H.value);
    hessian_gradients_ += found.gradients;
  }
  if (!ok && hessian_failure_.empty()) hessian_failure_ = failure;
  return ok;
}

bool DesignProgram::hessians(const VectorXd& x, std::vector<MatrixXd>& H) {
  const VectorXd rho_x = scaling_.rho_x(x), rho_xx = scaling_.rho_xx(x), rho = rho_at(x);
  std::vector<MatrixXd> psi_rhorho;
  if (!second_derivatives(rho, psi_rhorho)) return false;
  const MatrixXd psi_rho = evaluation(rho).psi_rho;  // of Gauss-Newton rho(x) is a part of the motion
  H.clear();
  for (Index i = 0; i <= constraints(); ++i) {
    MatrixXd of_x = rho_x.asDiagonal() * psi_rhorho[static_cast<std::size_t>(i)] * rho_x.asDiagonal();
    if (!gauss_newton_) of_x.diagonal() += psi_rho.row(i).transpose().cwiseProduct(rho_xx);
    H.push_back(i == 0 ? of_x : MatrixXd(of_x / size_(i - 1)));
  }
  return true;
}

bool DesignProgram::gradient_beside(const VectorXd& x, const VectorXd& d, VectorXd& f_x) {
  const Evaluation& at = evaluation(rho_at(x));
  if (!at.ok) return false;
  const Evaluation there = evaluator_.gradients_on(at.steps, rho_at(x + d), at.method);
  ++hessian_gradients_;
  if (there.ok) f_x = there.psi_rho.row(0).transpose().cwiseProduct(scaling_.rho_x(x + d));
  return there.ok;
}

}  // namespace mbsopt
