#include "core/start/nearest_point.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mbsopt {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kLocal = 1e-6;       // steps below it are taken whole: the merit function sees only rounding there
constexpr double kSatisfied = 1e-11;  // of F, per unit of x

double largest(const VectorXd& x) { return x.size() == 0 ? 0.0 : x.lpNorm<Eigen::Infinity>(); }

// I + curvature acts in the directions that the equations leave free. It is not evaluated if there are none.
MatrixXd hessian_at(NearestPointEquations& equations, const NearestPoint& at) {
  const bool determined = at.linearisation.null_space().cols() == 0;
  MatrixXd H = determined ? MatrixXd(MatrixXd::Zero(at.x.size(), at.x.size())) : equations.curvature(at.x, at.nu);
  H.diagonal().array() += 1;
  return H;
}

// Applies Levenberg-Marquardt to 1/2 |weights F|^2: brings x to the least violation of the equations.
void reduce_violation(NearestPointEquations& equations, int most, VectorXd& x, int& iterations) {
  double mu = 1e-3;
  VectorXd F = equations.values(x);
  MatrixXd J = equations.jacobian(x);
  const VectorXd scale = equations.weights();
  auto violation = [&](const VectorXd& f) { return scale.cwiseProduct(f).squaredNorm(); };
  for (int k = 0; k < most && mu < 1e12; ++k, ++iterations) {
    const MatrixXd A = scale.asDiagonal() * J;
    const VectorXd gradient = A.transpose() * scale.cwiseProduct(F);
    if (largest(gradient) < 1e-15) return;
    MatrixXd normal = A.transpose() * A;
    normal.diagonal().array() += mu;
    VectorXd step = cholesky_solve(normal, -gradient);
    step *= equations.step_fraction(step);
    const VectorXd trial = equations.retracted(x + step), F_trial = equations.values(trial);
    if (violation(F_trial) < violation(F)) {
      const bool negligible = violation(F) - violation(F_trial) < 1e-14 * violation(F);
      x = trial, F = F_trial;
      equations.accept(x);
      if (negligible) return;
      J = equations.jacobian(x);
      mu = std::max(mu / 5, 1e-14);
    } else {
      mu *= 4;
    }
  }
}

class Search {
 public:
  Search(NearestPointEquations& equations, const VectorXd& x_guess, int most)
      : equations_(equations), x_guess_(x_guess), most_(most) {
    result_.x = x_guess;
  }

  // Solves in metres. If that fails because lengths of micrometres or kilometres cost digits, it solves in units of the
  // sizes.
  NearestPoint run() {
    if (guess_is_it()) return result_;
    if (newton_of_determined()) return result_;
    move(x_guess_);
    search();
    if (result_.status != NearestPointStatus::found) {
      const NearestPoint in_metres = std::exchange(result_, NearestPoint{});
      sized_ = true;
      move(x_guess_);
      search();
      if (result_.status != NearestPointStatus::found) {
        move(in_metres.x);
        return in_metres;
      }
    }
    refine();
    result_.F = equations_.values(result_.x);
    return result_;
  }

 private:
  void search() {
    if (!newton()) sqp();
    result_.F = equations_.values(result_.x);
    const bool unsettled =
        result_.status == NearestPointStatus::stalled || result_.status == NearestPointStatus::unsatisfiable;
    if (unsettled && largest(result_.F) < 1e-9 * size()) result_.status = NearestPointStatus::singular;
  }

  // If the guess satisfies the equations to rounding, nothing is nearer: nu = 0 and H = I.
  bool guess_is_it() {
    const VectorXd x = equations_.retracted(x_guess_), F = equations_.values(x);
    if (!(largest(x - x_guess_) <= 4 * kEpsilon)) return false;  // only unit vectors are retracted
    if (!(F.cwiseAbs().array() <= 4 * kEpsilon * equations_.magnitudes(x).array()).all()) return false;
    result_.x = x, result_.F = F, result_.nu = VectorXd::Zero(F.size());
    result_.status = NearestPointStatus::found;
    result_.linearised = false;
    equations_.accept(x);
    return true;
  }

  // The Newton step of equations that leave no freedom. It uses the normal equations; the next step restores their lost
  // digits. It is empty if these are not positive definite to kDigits.
  VectorXd determined_step(const MatrixXd& J) const {
    constexpr double kDigits = 1e-8;  // of the pivots, squares of those of J
    if (J.rows() < J.cols()) return {};
    const VectorXd scale = J.rowwise().norm().unaryExpr([](double norm) { return norm > 0 ? 1 / norm : 1.0; });
    const MatrixXd A = scale.asDiagonal() * J;
    return definite_solve(A.transpose() * A, -(A.transpose() * scale.cwiseProduct(result_.F)), kDigits);
  }

  // Does the same as newton() for equations that leave no freedom. Returns false if they leave some, or if it does not
  // converge.
  bool newton_of_determined() {
    constexpr int kMost = 20;        // quadratic convergence takes far fewer
    constexpr double kClose = 1e-8;  // of each unknown's size: its square, the error left, is rounding
    for (int k = 0; k < kMost; ++k, ++result_.iterations) {
      result_.F = equations_.values(result_.x);
      if (!result_.F.allFinite()) return false;
      const MatrixXd J = equations_.jacobian(result_.x);
      const VectorXd step = determined_step(J);
      if (step.size() == 0) return false;
      const Eigen::ArrayXd close = (kClose * equations_.sizes(J)).cwiseMax(4 * kEpsilon * result_.x.cwiseAbs());
      const bool last = (step.array().abs() <= close).all();
      move(result_.x + equations_.step_fraction(step) * step);
      if (!last) continue;
      result_.F = equations_.values(result_.x);
      if (!satisfied()) continue;
      result_.nu = VectorXd::Zero(result_.F.size());
      result_.status = NearestPointStatus::found;
      result_.determined = true, result_.linearised = false;
      return true;
    }
    return false;
  }

  // Takes Gauss-Newton steps, then Newton steps. Returns false if neither converge.
  bool newton() {
    constexpr double kNear = 0.05;    // Gauss-Newton steps below it, per unit of x, may be Newton's instead
    constexpr double kConvex = 1e-3;  // least eigenvalue of Z'HZ at which they are
    constexpr int kPatience = 30;     // steps without a shorter one: it circles
    double shortest = std::numeric_limits<double>::infinity();
    for (int waited = 0; waited < kPatience && result_.iterations < most_; ++result_.iterations) {
      const VectorXd& x = result_.x;
      linearise();
      if (!result_.F.allFinite()) return true;
      const NearestPointLinearisation& at = result_.linearisation;
      const VectorXd away = x_guess_ - x;
      VectorXd step = at.pseudo_inverse_times(-result_.F) + at.null_space() * (at.null_space().transpose() * away);
      const double length = largest(step);
      if (length < 0.9 * shortest) {
        shortest = length, waited = 0;
      } else {
        ++waited;
      }
      if (length < kNear * size()) {
        add_curvature(at.multipliers(away));
        const VectorXd& lambda = at.reduced_eigenvalues();
        if (lambda.size() == 0 || lambda(0) > kConvex) step = at.solve(-result_.F, away);
        if (satisfied() && converged(largest(step))) {
          result_.status = is_minimum() ? NearestPointStatus::found : NearestPointStatus::undetermined;
          return true;
        }
      }
      move(x + equations_.step_fraction(step) * step);
    }
    return false;
  }

  void sqp() {
    constexpr int kRestorations = 3;
    int restorations = 0;
    const int last = result_.iterations + most_;
    shortest_ = std::numeric_limits<double>::infinity(), waited_ = 0;
    for (; result_.iterations < last; ++result_.iterations) {
      linearise();
      if (!result_.F.allFinite()) return;
      add_curvature(result_.linearisation.multipliers(x_guess_ - result_.x));
      const VectorXd step = result_.linearisation.descent(-result_.F, x_guess_ - result_.x);
      const bool still = converged(largest(step));
      if (still && satisfied()) {
        result_.status = is_minimum() ? NearestPointStatus::found : NearestPointStatus::undetermined;
        return;
      }
      if (!still && largest(step) < kLocal * size()) {
        move(result_.x + step);
      } else if (still || !gets_closer() || !advance(step)) {
        if (restorations++ == kRestorations || !restore()) {
          result_.status = NearestPointStatus::unsatisfiable;
          return;
        }
      }
    }
  }

  bool satisfied() const { return largest(result_.F) <= kSatisfied * size(); }
  double size() const { return 1 + largest(result_.x); }
  double scaled_violation(const VectorXd& F) const { return result_.linearisation.row_scale().cwiseProduct(F).norm(); }

  void linearise() {
    result_.F = equations_.values(result_.x);
    const MatrixXd J = equations_.jacobian(result_.x);
    result_.linearisation = sized_ ? NearestPointLinearisation(J, equations_.sizes(J)) : NearestPointLinearisation(J);
  }
  // Takes Newton steps to the rounding of each unknown, not of the largest.
  void refine() {
    sized_ = true;
    for (double last = std::numeric_limits<double>::infinity();;) {
      linearise();
      add_curvature(result_.linearisation.multipliers_at(x_guess_ - result_.x));
      const VectorXd step = result_.linearisation.solve(-result_.F, x_guess_ - result_.x);
      const double length = largest(step.cwiseQuotient(result_.linearisation.sizes() + VectorXd(result_.x.cwiseAbs())));
      if (!(length > 2 * kEpsilon) || !(length < 0.5 * last)) return;
      last = length;
      move(result_.x + step);
    }
  }
  void add_curvature(const VectorXd& nu) {
    result_.nu = nu;
    result_.linearisation.set_hessian(hessian_at(equations_, result_));
  }

  // Returns whether steps are at rounding level, or no longer shrink just above it.
  bool converged(double length) {
    if (length <= 2 * kEpsilon * size()) return true;
    if (length < 0.5 * shortest_) {
      shortest_ = length, waited_ = 0;
      return false;
    }
    return shortest_ < 1e-11 * size() && ++waited_ >= 2;
  }

  // Returns whether the violation still falls from time to time.
  bool gets_closer() {
    const double violation = scaled_violation(result_.F);
    if (violation < 0.7 * closest_ || violation < 1e-9) {
      closest_ = violation, patience_ = 25;
      return true;
    }
    return --patience_ > 0;
  }

  // Returns whether the minimum is strict: the nearest point moves at most 1e9 times as far as the guess.
  bool is_minimum() const {
    const VectorXd& lambda = result_.linearisation.reduced_eigenvalues();
    return lambda.size() == 0 || lambda(0) > 1e-9;
  }

  void move(const VectorXd& x) {
    result_.x = equations_.retracted(x);
    equations_.accept(result_.x);
  }

  // Takes one step along the merit function 1/2 |x - x_guess|^2 + sigma |scale F|. Returns false if it cannot be
  // reduced.
  bool advance(VectorXd step) {
    step *= equations_.step_fraction(step);
    const VectorXd away = result_.x - x_guess_;
    const VectorXd scale = result_.linearisation.row_scale();
    const VectorXd F = scale.cwiseProduct(result_.F);
    const double violation = F.norm();
    double slope = away.dot(step);
    if (violation > 0) {
      const VectorXd change = scale.cwiseProduct(VectorXd(equations_.jacobian(result_.x) * step));
      const double reduction = -F.dot(change) / violation;
      if (violation > 1e-10 && reduction < 1e-8 * std::min(violation, step.norm())) return false;
      const double rise = slope + 0.5 * step.squaredNorm();
      if (rise > 0 && reduction > 0) sigma_ = std::max(sigma_, 2 * rise / reduction);
      slope -= sigma_ * reduction;
    }
    if (!(slope < 0)) {
      if (violation > 1e-8) return false;
      move(result_.x + step);
      return true;
    }
    auto merit = [&](const VectorXd& x, const VectorXd& f) {
      return 0.5 * (x - x_guess_).squaredNorm() + sigma_ * scaled_violation(f);
    };
    const double now = merit(result_.x, result_.F);
    for (double part = 1; part > 1e-7; part *= 0.5) {
      const VectorXd trial = result_.x + part * step;
      if (merit(trial, equations_.values(trial)) > now + 1e-4 * part * slope) continue;
      move(trial);
      return true;
    }
    return false;
  }

  // Returns false if the violation alone does not go to zero.
  bool restore() {
    VectorXd x = result_.x;
    reduce_violation(equations_, most_, x, result_.iterations);
    result_.x = x;
    closest_ = shortest_ = std::numeric_limits<double>::infinity();
    return largest(equations_.values(x)) < 1e-9 * size();
  }

  NearestPointEquations& equations_;
  const VectorXd x_guess_;
  const int most_;  // iterations of each method
  NearestPoint result_;
  bool sized_ = false;
  double sigma_ = 1;
  double shortest_ = std::numeric_limits<double>::infinity(), closest_ = shortest_;
  int waited_ = 0, patience_ = 0;
};

}  // namespace

NearestPoint nearest_point(NearestPointEquations& equations, const VectorXd& x_guess, Decomposition decomposition,
                           int iterations) {
  NearestPoint found = Search(equations, x_guess, iterations).run();
  if (decomposition == Decomposition::now) linearise(equations, found);
  return found;
}

void linearise(NearestPointEquations& equations, NearestPoint& found) {
  if (found.linearised) return;
  found.linearised = true;
  const MatrixXd J = equations.jacobian(found.x);
  found.linearisation = NearestPointLinearisation(J, equations.sizes(J));
  found.linearisation.set_hessian(hessian_at(equations, found));
}

}  // namespace mbsopt
