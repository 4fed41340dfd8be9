#include "optim/objective/hessian.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/cvodes/cvodes.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/machine/stopwatch.hpp"

namespace mbsopt::inline optim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A gradient carries the rounding of a forward and a backward sweep over all steps.
constexpr double kGradientRounding = 1e-13;
// A bound nearer than this part of the wanted step is too near for a step on both sides.
constexpr double kNear = 1.0 / 16;
// If rounding hides more than this part of H d, the parameter's value is no measure of its effect, and the step grows.
constexpr double kHidden = 1e-8;
constexpr double kGrowth = 16;
constexpr int kWiderLadders = 2;

// The gradients of all objectives as functions of rho + h d on frozen steps, and their derivatives in h. All numbers
// are in sizes of parameters, row by row: component i n + j of F is d psi_i/d rho_j times the size of rho_j.
class GradientAlong {
 public:
  GradientAlong(Evaluator& evaluator, const VectorXd& rho, const HessianOptions& options)
      : evaluator_(evaluator), options_(options), rho_(rho), size_(evaluator.sizes(rho)) {
    require_second_order(evaluator.scene(), evaluator.options().method);
    base_ = evaluator.gradients(rho);
  }

  bool ok() const { return base_.ok; }
  const std::string& message() const { return base_.ok ? why_ : base_.message; }
  const Evaluation& base() const { return base_; }
  const VectorXd& sizes() const { return size_; }
  Index variables() const { return size_.size(); }
  Index objectives() const { return base_.psi.size(); }
  long gradients() const { return gradients_; }
  const Parameter& parameter(Index k) const { return evaluator_.variable(k); }
  double largest_gradient(Index objective) const {
    return base_.psi_rho.row(objective).transpose().cwiseProduct(size_).cwiseAbs().maxCoeff();
  }

  // F'(0) along d, which is given in sizes with its largest component 1. It has no estimates if it could not be
  // evaluated.
  LadderDerivative derivative(const VectorXd& d) {
    double h = options_.relative_step;
    Reach reach = reach_along(d, h);
    LadderDerivative best = without_constants(ladder(d, reach));
    for (int i = 0; i < kWiderLadders && best.has_estimate(0) && rounding_hides(best); ++i) {
      if (reach.step < h) break;  // the bounds are all the room there is
      h *= kGrowth;
      reach = reach_along(d, h);
      best.take_better(without_constants(ladder(d, reach)));
    }
    return best;
  }

 private:
  struct Reach {
    double step;
    int side;  // +1, -1, or 0: both
  };

  int index(Index k) const { return evaluator_.variables()[static_cast<std::size_t>(k)]; }

  std::optional<VectorXd> gradient_at(const VectorXd& d, double h) {
    VectorXd rho = rho_;
    for (Index k = 0; k < d.size(); ++k) rho(index(k)) += h * d(k) * size_(k);
    const Evaluation e = evaluator_.gradients_on(base_.steps, rho, base_.method);
    ++gradients_;
    if (!e.ok) {
      why_ = e.message;
      return std::nullopt;
    }
    VectorXd F(objectives() * variables());
    for (Index i = 0; i < objectives(); ++i)
      F.segment(i * variables(), variables()) = e.psi_rho.row(i).transpose().cwiseProduct(size_);
    return F;
  }

  // F at the point itself, on the same frozen steps: implicit stages are then solved to rounding, as at all other
  // points.
  const VectorXd& F0() {
    if (F0_.size() == 0) F0_ = gradient_at(VectorXd::Zero(variables()), 0).value_or(VectorXd());
    return F0_;
  }

  // Keeps within the bounds. It steps to both sides, as far as wanted or as the bounds allow, or else to the side with
  // more room. Close bounds on both sides do not tell the parameter's size and are ignored.
  Reach reach_along(const VectorXd& d, double h) const {
    constexpr double kInside = 1 - 1e-9;  // rounding must not cross the bound
    double plus = kInfinity, minus = kInfinity;
    for (Index k = 0; k < d.size(); ++k) {
      if (d(k) == 0) continue;
      const Parameter& p = parameter(k);
      const double value = rho_(index(k)), slope = d(k) * size_(k);
      double above = p.upper ? (*p.upper - value) / std::abs(slope) : kInfinity;
      double below = p.lower ? (value - *p.lower) / std::abs(slope) : kInfinity;
      if (slope < 0) std::swap(above, below);
      plus = std::min(plus, kInside * above);
      minus = std::min(minus, kInside * below);
    }
    const double least = std::min(plus, minus), most = std::max(plus, minus);
    if (least >= kNear * h) return {std::min(h, least), 0};
    if (most >= kNear * h) return {std::min(h, most), plus > minus ? 1 : -1};
    return {h, 0};
  }

  LadderDerivative ladder(const VectorXd& d, const Reach& reach) {
    const auto F = [&](double h) { return gradient_at(d, h); };
    LadderOptions options{reach.step, options_.rungs, kGradientRounding,
                          [&](const LadderDerivative& best) { return good_enough(best); }};
    LadderDerivative best;
    if (reach.side == 0) {
      best = difference_ladder(F, objectives() * variables(), options);
      if (best.has_estimate(0)) return best;
    }
    // One side may lie outside the domain of an expression.
    for (const int side : {1, -1}) {
      if ((reach.side != 0 && side != reach.side) || F0().size() == 0) continue;
      options.step = side * reach.step;
      best = one_sided_ladder(F, F0(), options);
      if (best.has_estimate(0)) break;
    }
    return best;
  }

  // An entry that no step changed by a bit is constant.
  static LadderDerivative without_constants(LadderDerivative found) {
    for (Index c = 0; c < found.error.size(); ++c)
      if (found.derivative(c) == 0 && found.has_estimate(c) && found.error(c) == found.rounding(c)) found.error(c) = 0;
    return found;
  }

  bool good_enough(const LadderDerivative& best) const {
    for (Index i = 0; i < objectives(); ++i) {
      const auto part = Eigen::seqN(i * variables(), variables());
      const double size = std::max(best.derivative(part).cwiseAbs().maxCoeff(), largest_gradient(i));
      if (!(best.error(part).maxCoeff() <= options_.enough * size)) return false;
    }
    return true;
  }

  bool rounding_hides(const LadderDerivative& best) const {
    for (Index i = 0; i < objectives(); ++i) {
      const auto part = Eigen::seqN(i * variables(), variables());
      Index worst = 0;
      const double error = best.error(part).maxCoeff(&worst);
      const bool by_rounding = error <= 2 * best.rounding(i * variables() + worst);
      if (by_rounding && error > kHidden * best.derivative(part).cwiseAbs().maxCoeff()) return true;
    }
    return false;
  }

  Evaluator& evaluator_;
  const HessianOptions& options_;
  const VectorXd rho_;
  VectorXd size_;
  Evaluation base_;
  VectorXd F0_;
  std::string why_;
  long gradients_ = 0;
};

std::string not_differenced(const std::string& what, const std::string& why) {
  return fmt::format("the gradient could not be differenced in {}: {}", what,
                     why.empty() ? "too few steps could be evaluated" : why);
}

// raw(p, q) is the derivative in q of the gradient's entry p; both are in sizes.
ObjectiveHessian symmetrised(const MatrixXd& raw, const MatrixXd& raw_error, const VectorXd& size) {
  ObjectiveHessian H;
  const MatrixXd apart = (raw - raw.transpose()).cwiseAbs();
  const MatrixXd error = raw_error.cwiseMax(raw_error.transpose()).cwiseMax(apart);
  const MatrixXd value = 0.5 * (raw + raw.transpose());
  if (value.size() > 0) {
    H.largest_error = error.maxCoeff();
    H.largest_entry = value.cwiseAbs().maxCoeff();
    H.asymmetry = apart.maxCoeff();
  }
  const MatrixXd unit = (size * size.transpose()).cwiseInverse();
  H.value = value.cwiseProduct(unit);
  H.error = error.cwiseProduct(unit);
  return H;
}

}  // namespace

double ObjectiveHessian::relative() const { return largest_error == 0 ? 0 : largest_error / largest_entry; }

void require_second_order(const Scene& scene, GradientMethod method) {
  const std::string& integrator = scene.simulation.integrator.type;
  if (is_cvodes(integrator))
    throw std::invalid_argument(
        fmt::format("simulation.integrator.type: is {}, whose steps cannot be frozen: second derivatives are "
                    "differences of discrete gradients on frozen steps; take a Runge-Kutta method, dopri5 or radau5",
                    integrator));
  if (method != GradientMethod::automatic && method != GradientMethod::tlm && method != GradientMethod::adjoint)
    throw std::invalid_argument(fmt::format(
        "second derivatives by {}: there are none; they are differences of the discrete gradient, by adjoint or tlm",
        to_string(method)));
}

Hessians hessians(Evaluator& evaluator, const VectorXd& rho, const HessianOptions& options) {
  const Stopwatch stopwatch;
  Hessians result;
  GradientAlong along(evaluator, rho, options);
  if (!along.ok()) {
    result.message = along.message();
    return result;
  }
  const Index n = along.variables(), m = along.objectives();
  result.method = along.base().method;
  std::vector<MatrixXd> raw(static_cast<std::size_t>(m), MatrixXd::Zero(n, n)), error = raw;
  for (Index q = 0; q < n; ++q) {
    const LadderDerivative column = along.derivative(VectorXd::Unit(n, q));
    result.gradients = along.gradients();
    if (m > 0 && !column.has_estimate(0)) {
      result.message = not_differenced(fmt::format("'{}'", along.parameter(q).name), along.message());
      return result;
    }
    for (Index i = 0; i < m; ++i) {
      raw[static_cast<std::size_t>(i)].col(q) = column.derivative.segment(i * n, n);
      error[static_cast<std::size_t>(i)].col(q) = column.error.segment(i * n, n);
    }
    if (options.progress && !options.progress(static_cast<int>(q) + 1, static_cast<int>(n))) {
      result.message = "abandoned";
      return result;
    }
  }
  for (Index i = 0; i < m; ++i) {
    const auto at = static_cast<std::size_t>(i);
    result.of.push_back(symmetrised(raw[at], error[at], along.sizes()));
    if (n > 0) result.of.back().gradient = along.largest_gradient(i);
  }
  result.ok = true;
  result.wall_seconds = stopwatch.seconds();
  return result;
}

HessianProducts hessian_products(Evaluator& evaluator, const VectorXd& rho, const VectorXd& d,
                                 const HessianOptions& options) {
  HessianProducts result;
  GradientAlong along(evaluator, rho, options);
  const Index n = along.variables(), m = along.objectives();
  if (d.size() != n)
    throw std::invalid_argument(fmt::format("a direction of {} components for {} variables", d.size(), n));
  if (!along.ok()) {
    result.message = along.message();
    return result;
  }
  result.product.setZero(m, n);
  result.error.setZero(m, n);
  result.ok = true;
  const VectorXd in_sizes = d.cwiseQuotient(along.sizes());
  const double longest = n > 0 ? in_sizes.cwiseAbs().maxCoeff() : 0;
  if (longest == 0 || m == 0) return result;
  const LadderDerivative found = along.derivative(in_sizes / longest);
  result.gradients = along.gradients();
  if (!found.has_estimate(0)) {
    result.ok = false;
    result.message = not_differenced("this direction", along.message());
    return result;
  }
  for (Index i = 0; i < m; ++i) {
    result.product.row(i) = longest * found.derivative.segment(i * n, n).cwiseQuotient(along.sizes()).transpose();
    result.error.row(i) = longest * found.error.segment(i * n, n).cwiseQuotient(along.sizes()).transpose();
  }
  return result;
}

std::string hessian_method(GradientMethod method) {
  const bool by_tlm = method == GradientMethod::tlm;
  return fmt::format(
      "central differences (one-sided on a bound) of the {} gradient on frozen steps, extrapolated; not forward over "
      "adjoint",
      method == GradientMethod::automatic ? "objectives' own"
      : by_tlm                            ? "tangent-linear"
                                          : "adjoint");
}

}  // namespace mbsopt::inline optim
