#include "core/start/nearest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbsopt {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSatisfied = 1e-11;  // of F, per unit of x

double largest(const VectorXd& x) { return x.size() == 0 ? 0.0 : x.lpNorm<Eigen::Infinity>(); }

// I + curvature acts in the directions that the equations leave free. It is not evaluated if there are none.
MatrixXd hessian_at(NearestPointEquations& equations, const NearestPoint& at) {
  const bool determined = at.linearisation.null_space().cols() == 0;
  MatrixXd H = determined ? MatrixXd(MatrixXd::Zero(at.x.size(), at.x.size())) : equations.curvature(at.x, at.nu);
  H.diagonal().array() += 1;
  return H;
}

class NearestPointSearch {
 public:
  NearestPointSearch(NearestPointEquations& equations, const VectorXd& x_guess, int most)
      : equations_(equations), x_guess_(x_guess), most_(most) {
    result_.x = x_guess;
  }

  NearestPoint run() {
    constexpr int kRestorations = 3;
    if (guess_is_it()) return result_;
    move(x_guess_);
    for (int restorations = 0; !iterate(); ++restorations) {
      if (restorations < kRestorations && restore()) continue;
      result_.status = NearestPointStatus::unsatisfiable;
      break;
    }
    result_.F = equations_.values(result_.x);
    const bool unsettled =
        result_.status == NearestPointStatus::stalled || result_.status == NearestPointStatus::unsatisfiable;
    if (unsettled && is_closed()) result_.status = NearestPointStatus::singular;
    return result_;
  }

 private:
  // If the guess satisfies the equations to rounding, nothing is nearer: nu = 0 and H = I.
  bool guess_is_it() {
    const VectorXd x = equations_.retracted(x_guess_), F = equations_.values(x);
    if (!(largest(x - x_guess_) <= 4 * kEpsilon)) return false;  // only unit vectors are retracted
    if (!F.isZero(0) && !(F.cwiseAbs().array() <= 4 * kEpsilon * equations_.magnitudes(x).array()).all()) return false;
    settle_without_multipliers(x, F);
    equations_.accept(x);
    return true;
  }
  void settle_without_multipliers(const VectorXd& x, const VectorXd& F) {
    result_.x = x;
    result_.F = F;
    result_.nu = VectorXd::Zero(F.size());
    result_.status = NearestPointStatus::found;
    result_.linearised = false;
  }

  // The step of equations that leave no freedom. It uses the normal equations; the next step restores their lost
  // digits. It is empty if these are not positive definite to kDigits.
  VectorXd determined_step(const UnitRows& rows, const VectorXd& sizes) const {
    constexpr double kDigits = 1e-8;  // of the pivots, squares of those of J
    const MatrixXd& A = rows.J;       // J in units of the sizes
    if (A.rows() < A.cols()) return {};
    const VectorXd step =
        definite_solve(A.transpose() * A, -(A.transpose() * rows.scale.cwiseProduct(result_.F)), kDigits);
    return step.size() > 0 ? VectorXd(sizes.cwiseProduct(step)) : step;
  }

  // Takes Gauss-Newton steps, then Newton steps to the rounding of each unknown. Equations that leave no freedom need
  // no decomposition, and both steps are the same. If steps do not become shorter, only a part of those along the
  // equations is taken, from beside the point: it may be one of symmetry, which no step leaves. Returns false if the
  // equations do not come closer either.
  bool iterate() {
    constexpr double kNear = 0.05;    // Gauss-Newton steps below it, per unit of x, may be Newton's instead
    constexpr double kClose = 1e-8;   // of each unknown's size: the square of a step, the error left, is rounding
    constexpr int kPatience = 30;     // steps without a shorter one: it circles
    constexpr double kBeside = 1e-3;  // of the sizes
    double shortest = kInfinity, closest = kInfinity, closest_before = kInfinity, last = kInfinity, part = 1;
    const int end = result_.iterations + most_;
    for (int waited = 0; result_.iterations < end; ++result_.iterations) {
      result_.F = equations_.values(result_.x);
      if (!result_.F.allFinite()) return true;
      const MatrixXd J = equations_.jacobian(result_.x);
      const VectorXd sizes = equations_.sizes(J), away = x_guess_ - result_.x;
      const UnitRows rows(J * sizes.asDiagonal());
      VectorXd step;
      if (!decomposes_) step = determined_step(rows, sizes);
      decomposes_ = step.size() == 0;
      if (decomposes_) result_.linearisation = NearestPointLinearisation(J, sizes);
      const NearestPointLinearisation& at = result_.linearisation;
      const auto along = [&](const VectorXd& x) {
        return VectorXd(at.null_space() * (at.null_space().transpose() * x));
      };
      if (decomposes_) step = at.pseudo_inverse_times(-result_.F) + part * along(away);
      const double length = largest(step);
      if (!satisfied() && length <= 2 * kEpsilon * size()) return false;  // nothing shows a direction
      closest = std::min(closest, rows.scale.cwiseProduct(result_.F).norm());
      if (length < 0.9 * shortest) {
        shortest = length;
        waited = 0;
      } else if (++waited == kPatience) {
        if (!(closest < 0.7 * closest_before)) return false;
        closest_before = closest;
        shortest = kInfinity;
        waited = 0;
        part /= 4;
        if (decomposes_) move(result_.x + along(kBeside * sizes));
        continue;
      }
      if (decomposes_ && length < kNear * part * size() && turn_to_newton(away, sizes, step, last)) return true;
      const Eigen::ArrayXd close = (kClose * sizes).cwiseMax(4 * kEpsilon * result_.x.cwiseAbs());
      move(result_.x + equations_.step_fraction(step) * step);
      if (decomposes_ || (step.array().abs() > close).any()) continue;
      result_.F = equations_.values(result_.x);
      if (!satisfied()) continue;
      settle_without_multipliers(result_.x, result_.F);
      result_.determined = true;
      return true;
    }
    return true;
  }

  // Replaces a Gauss-Newton step by Newton's where the problem is convex. Returns true at the nearest point: the step
  // consists of rounding. `last` is the previous step, relative to each unknown.
  bool turn_to_newton(const VectorXd& away, const VectorXd& sizes, VectorXd& step, double& last) {
    constexpr double kConvex = 1e-3;  // least eigenvalue of Z'HZ at which steps are Newton's
    constexpr double kStrict = 1e-9;  // the same of a minimum: the nearest point moves at most 1e9 times as far
    constexpr double kFlat = 1e-11;   // steps below it, relative to each unknown, may consist of rounding
    NearestPointLinearisation& at = result_.linearisation;
    result_.nu = at.multipliers_at(away);
    at.set_hessian(hessian_at(equations_, result_));
    const VectorXd& lambda = at.reduced_eigenvalues();
    if (lambda.size() == 0 || lambda(0) > kConvex) step = at.solve(-result_.F, away);
    const double relative = largest(step.cwiseQuotient(sizes + VectorXd(result_.x.cwiseAbs())));
    const bool is_rounding = relative <= 2 * kEpsilon || (relative < kFlat && !(relative < 0.5 * last));
    last = relative;
    if (!satisfied() || !is_rounding) return false;
    const bool is_minimum = lambda.size() == 0 || lambda(0) > kStrict;
    result_.status = is_minimum ? NearestPointStatus::found : NearestPointStatus::undetermined;
    return true;
  }

  // Applies Levenberg-Marquardt to 1/2 |weights F|^2. Returns whether the least violation is zero.
  bool restore() {
    const VectorXd scale = equations_.weights();
    const auto violation = [&](const VectorXd& F) { return scale.cwiseProduct(F).squaredNorm(); };
    double mu = 1e-3;
    VectorXd F = equations_.values(result_.x);
    MatrixXd J = equations_.jacobian(result_.x);
    for (int k = 0; k < most_ && mu < 1e12; ++k, ++result_.iterations) {
      const MatrixXd A = scale.asDiagonal() * J;
      const VectorXd gradient = A.transpose() * scale.cwiseProduct(F);
      if (largest(gradient) < 1e-15) break;
      MatrixXd normal = A.transpose() * A;
      normal.diagonal().array() += mu;
      VectorXd step = cholesky_solve(normal, -gradient);
      step *= equations_.step_fraction(step);
      const VectorXd trial = equations_.retracted(result_.x + step), F_trial = equations_.values(trial);
      if (!(violation(F_trial) < violation(F))) {
        mu *= 4;
        continue;
      }
      const bool negligible = violation(F) - violation(F_trial) < 1e-14 * violation(F);
      move(trial);
      F = F_trial;
      if (negligible) break;
      J = equations_.jacobian(result_.x);
      mu = std::max(mu / 5, 1e-14);
    }
    result_.F = F;
    return is_closed();
  }

  bool satisfied() const { return largest(result_.F) <= kSatisfied * size(); }
  bool is_closed() const { return largest(result_.F) < 1e-9 * size(); }
  double size() const { return 1 + largest(result_.x); }

  void move(const VectorXd& x) {
    result_.x = equations_.retracted(x);
    equations_.accept(result_.x);
  }

  NearestPointEquations& equations_;
  const VectorXd x_guess_;
  const int most_;           // iterations of each method
  bool decomposes_ = false;  // J: the normal equations do not determine a step
  NearestPoint result_;
};

}  // namespace

NearestPoint nearest_point(NearestPointEquations& equations, const VectorXd& x_guess, int iterations) {
  return NearestPointSearch(equations, x_guess, iterations).run();
}

void linearise(NearestPointEquations& equations, NearestPoint& found) {
  if (found.linearised) return;
  found.linearised = true;
  const MatrixXd J = equations.jacobian(found.x);
  found.linearisation = NearestPointLinearisation(J, equations.sizes(J));
  found.linearisation.set_hessian(hessian_at(equations, found));
}

}  // namespace mbsopt
