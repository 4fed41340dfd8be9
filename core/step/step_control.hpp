// Step-size control: error norm, PI controller, first step.
//   Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.4; PI control: Gustafsson
//   (1991), Hairer, Wanner, "Solving Ordinary Differential Equations II", section IV.2.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace mbsopt {

// h rounded down to a power of e^(1/parts): estimates of error that differ by rounding lead to the very same step, and
// with it to results that differ by rounding only, where steps that differ in their last digits would put a part of the
// method's error between them. Costs 0.5 % of h on average. Powers of two would put steps on round times, where laws
// have their corners.
inline double rounded_step(double h, double parts = 100) {
  constexpr double kOnIt = 1e-9;  // such a power stays as it is
  return std::exp(std::floor(parts * std::log(h) + kOnIt) / parts);
}

// h -> h * factor with factor = 0.9 err^-(1/k - 0.75 beta) err_old^beta, k the power of h in the estimate (p for an
// estimate of order p - 1), beta = 0.2/k; at most 6, which is taken where the error would stay below a half with it:
// estimates so small are mostly rounding, by methods of high order.
class PiController {
 public:
  explicit PiController(int error_order)
      : beta_(0.2 / error_order),
        exponent_(1.0 / error_order - 0.75 * beta_),
        small_(0.5 * std::pow(6, -error_order)) {}

  double after_acceptance(double error) {
    double factor = error < small_ ? 6 : 0.9 * std::pow(error, -exponent_) * std::pow(previous_, beta_);
    factor = std::clamp(factor, 0.2, last_rejected_ ? 1.0 : 6.0);
    previous_ = std::max(error, 1e-4);
    last_rejected_ = false;
    return factor;
  }
  // A step whose estimate is not to decide on the next one.
  void after_passage() { last_rejected_ = false; }
  double after_rejection(double error) {
    last_rejected_ = true;
    return std::isfinite(error) ? std::max(0.2, 0.9 * std::pow(error, -exponent_)) : 0.2;
  }

 private:
  double beta_, exponent_, small_;
  double previous_ = 1e-4;
  bool last_rejected_ = false;
};

// Root mean square of x_i / (atol + rtol max(|a_i|, |b_i|)).
inline double scaled_norm(const Eigen::VectorXd& x, const Eigen::VectorXd& a, const Eigen::VectorXd& b, double rtol,
                          double atol) {
  double sum = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double e = x(i) / (atol + rtol * std::max(std::abs(a(i)), std::abs(b(i))));
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
