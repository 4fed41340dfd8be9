// Step-size control: error norm, controllers.
//   Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.4; PI control: Gustafsson
//   (1991), Hairer, Wanner, "Solving Ordinary Differential Equations II", section IV.2.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/scene/settings.hpp"
#include "core/step/component_tolerances.hpp"

namespace mbsopt {

// h rounded down to a power of e^(1/parts). Estimates of error that differ by rounding then lead to the same step, and
// results differ by rounding only. Steps that differ in their last digits would make results differ by a part of the
// method's error. The rounding costs 0.5 % of h on average. Powers of two would put steps on round times, where laws
// have their corners.
inline double rounded_step(double h, double parts = 100) {
  constexpr double kOnIt = 1e-9;  // such a power stays as it is
  return std::exp(std::floor(parts * std::log(h) + kOnIt) / parts);
}

// h -> h * factor with factor = safety err^-a err_old^b err_older^-c, between factor_min and factor_max. k is the power
// of h in the estimate (p for an estimate of order p - 1).
//   PI:  a = (1 - 0.15)/k, b = 0.2/k
//   I:   a = 1/k
//   PID: a = 0.58/k, b = 0.21/k, c = 0.1/k: Kennedy, Carpenter, Applied Numerical Mathematics 44 (2003)
// The factor is factor_max if the error would then stay below a half. Methods of high order have such small estimates
// mostly from rounding.
class StepController {
 public:
  StepController(int error_order, const IntegratorOptions& options)
      : least_(options.factor_min.value_or(0.2)),
        most_(options.factor_max.value_or(6)),
        safety_(options.safety.value_or(0.9)),
        small_(0.5 * std::pow(most_, -error_order)),
        k_(error_order) {
    const double k = error_order;
    if (options.controller == "I") {
      a_ = 1 / k;
    } else if (options.controller == "PID") {
      a_ = 0.58 / k;
      b_ = 0.21 / k;
      c_ = 0.1 / k;
    } else {
      b_ = 0.2 / k;
      a_ = 1 / k - 0.75 * b_;
    }
  }

  double after_acceptance(double error) {
    double factor =
        error < small_ ? most_ : safety_ * std::pow(error, -a_) * std::pow(previous_, b_) * std::pow(older_, -c_);
    factor = std::clamp(factor, least_, last_rejected_ ? 1.0 : most_);
    older_ = previous_;
    previous_ = std::max(error, kLeastError);
    last_rejected_ = false;
    return factor;
  }
  // The factor that the error allows, without history and limits.
  double allowed(double error) const { return safety_ * std::pow(std::max(error, 1e-12), -1 / k_); }
  // Accepts a step whose estimate must not influence the next one.
  void after_passage() { last_rejected_ = false; }
  double after_rejection(double error) {
    last_rejected_ = true;
    return std::isfinite(error) ? std::max(least_, safety_ * std::pow(error, -a_)) : least_;
  }

 private:
  static constexpr double kLeastError = 1e-4;
  double least_, most_, safety_, small_, k_;
  double a_ = 0, b_ = 0, c_ = 0;
  double previous_ = kLeastError, older_ = kLeastError;
  bool last_rejected_ = false;
};

// Root mean square of x_i / (atol_i + rtol_i max(|a_i|, |b_i|)).
inline double scaled_norm(const Eigen::VectorXd& x, const Eigen::VectorXd& a, const Eigen::VectorXd& b,
                          const ComponentTolerances& tolerances) {
  double sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double e = x(i) / tolerances.of(i, std::max(std::abs(a(i)), std::abs(b(i))));
    sum += e * e;
  }
  return std::sqrt(sum / static_cast<double>(x.size()));
}

// Two estimates of different order as in DOP853: high^2/sqrt(high^2 + 0.01 low^2).
inline double combined_error(double high, double low) {
  const double both = std::sqrt(high * high + 0.01 * low * low);
  return both > 0 ? high * high / both : 0.0;
}

}  // namespace mbsopt
