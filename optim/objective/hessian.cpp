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
      : size(evaluator.sizes(rho)), evaluator_(evaluator), options_(options), n_(size.size()) {
    require_second_order(evaluator.scene(), evaluator.options().method);
    base = evaluator.gradients(rho);
    message = base.message;
  }

  // F'(0) along d, which is given in sizes with its largest component 1. It has no estimates if it could not be
  // evaluated.
  LadderDerivative derivative(const VectorXd& d) {
    double h = options_.relative_step;
    Reach reach = reach_along(d, h);
    LadderDerivative best = ladder(d, reach);
    for (int i = 0; i < kWiderLadders && best.has_estimate(0) && rounding_hides(best); ++i) {
      if (reach.step < h) break;  // the bounds are all the room there is
      h *= kGrowth;
      reach = reach_along(d, h);
      best.take_better(ladder(d, reach));
    }
    return best;
  }
  double largest_gradient(Index objective) const {
    return base.psi_rho.row(objective).transpose().cwiseProduct(size).cwiseAbs().maxCoeff();
  }

  const VectorXd size;
  Evaluation base;
  std::string message;  // why something could not be evaluated
  long gradients = 0;

 private:
  struct Reach {
    double step;
    int side;  // +1, -1, or 0: both
  };

  std::optional<VectorXd> gradient_at(const VectorXd& d, double h) {
    VectorXd rho = base.rho;
    rho(evaluator_.variables()) += (h * d).cwiseProduct(size);
    const Evaluation e = evaluator_.gradients_on(base.steps, rho, base.method);
    ++gradients;
    if (!e.ok) {
      message = e.message;
      return std::nullopt;
    }
    return VectorXd((e.psi_rho * size.asDiagonal()).transpose().reshaped());
  }

  // F at the point itself, on the same frozen steps: implicit stages are then solved to rounding, as at all other
  // points.
  const VectorXd& F0() {
    if (F0_.size() == 0) F0_ = gradient_at(VectorXd::Zero(n_), 0).value_or(VectorXd());
    return F0_;
  }

  // Keeps within the bounds. It steps to both sides, as far as wanted or as the bounds allow, or else to the side with
  // more room. Close bounds on both sides do not tell the parameter's size and are ignored.
  Reach reach_along(const VectorXd& d, double h) const {
    constexpr double kInside = 1 - 1e-9;  // rounding must not cross the bound
    double plus = kInfinity, minus = kInfinity;
    for (Index k = 0; k < n_; ++k) {
      if (d(k) == 0) continue;
      const Parameter& p = evaluator_.variable(k);
      const double value = base.rho(evaluator_.variables()[static_cast<std::size_t>(k)]), slope = d(k) * size(k);
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
    if (reach.side == 0) best = difference_ladder(F, base.psi.size() * n_, options);
    // One side may lie outside the domain of an expression.
    for (const int side : {1, -1}) {
      if (best.has_estimate(0)) break;
      if ((reach.side != 0 && side != reach.side) || F0().size() == 0) continue;
      options.step = side * reach.step;
      best = one_sided_ladder(F, F0(), options);
    }
    for (Index c = 0; c < best.error.size(); ++c)  // an entry that no step changed by a bit is constant
      if (best.derivative(c) == 0 && best.has_estimate(c) && best.error(c) == best.rounding(c)) best.error(c) = 0;
    return best;
  }

  bool good_enough(const LadderDerivative& best) const {
    for (Index i = 0; i < base.psi.size(); ++i) {
      const double size_of_row =
          std::max(best.derivative.segment(i * n_, n_).cwiseAbs().maxCoeff(), largest_gradient(i));
      if (!(best.error.segment(i * n_, n_).maxCoeff() <= options_.enough * size_of_row)) return false;
    }
    return true;
  }

  bool rounding_hides(const LadderDerivative& best) const {
    for (Index i = 0; i < base.psi.size(); ++i) {
      Index worst = 0;
      const double error = best.error.segment(i * n_, n_).maxCoeff(&worst);
      const bool by_rounding = error <= 2 * best.rounding(i * n_ + worst);
      if (by_rounding && error > kHidden * best.derivative.segment(i * n_, n_).cwiseAbs().maxCoeff()) return true;
    }
    return false;
  }

  Evaluator& evaluator_;
  const HessianOptions& options_;
  const Index n_;  // variables
  VectorXd F0_;
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
  GradientAlong along(evaluator, rho, options);
  Hessians result;
  result.message = along.message;
  if (!along.base.ok) return result;
  const Index n = along.size.size(), m = along.base.psi.size();
  result.method = along.base.method;
  std::vector<MatrixXd> raw(static_cast<std::size_t>(m), MatrixXd::Zero(n, n)), error = raw;
  for (Index q = 0; q < n; ++q) {
    const LadderDerivative column = along.derivative(VectorXd::Unit(n, q));
    result.gradients = along.gradients;
    if (m > 0 && !column.has_estimate(0)) {
      result.message = not_differenced(fmt::format("'{}'", evaluator.variable(q).name), along.message);
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
    result.of.push_back(symmetrised(raw[at], error[at], along.size));
    if (n > 0) result.of.back().gradient = along.largest_gradient(i);
  }
  result.ok = true;
  result.message.clear();
  result.wall_seconds = stopwatch.seconds();
  return result;
}

HessianProducts hessian_products(Evaluator& evaluator, const VectorXd& rho, const VectorXd& d,
                                 const HessianOptions& options) {
  GradientAlong along(evaluator, rho, options);
  const Index n = along.size.size(), m = along.base.psi.size();
  if (d.size() != n)
    throw std::invalid_argument(fmt::format("a direction of {} components for {} variables", d.size(), n));
  HessianProducts result{along.base.ok, along.message, MatrixXd::Zero(m, n), MatrixXd::Zero(m, n)};
  const VectorXd in_sizes = d.cwiseQuotient(along.size);
  const double longest = n > 0 ? in_sizes.cwiseAbs().maxCoeff() : 0;
  if (!result.ok || longest == 0 || m == 0) return result;
  const LadderDerivative found = along.derivative(in_sizes / longest);
  result.gradients = along.gradients;
  result.ok = found.has_estimate(0);
  result.message = result.ok ? "" : not_differenced("this direction", along.message);
  if (!result.ok) return result;
  const auto in_parameters = [&](const VectorXd& of_F) -> MatrixXd {
    return longest * of_F.reshaped(n, m).transpose() * along.size.cwiseInverse().asDiagonal();
  };
  result.product = in_parameters(found.derivative);
  result.error = in_parameters(found.error);
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
