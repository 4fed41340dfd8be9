#include "optim/solver/robust_loss.hpp"

#include <cmath>
#include <limits>

namespace mbsopt::inline optim {

double usual_scale(LossType type) {
  switch (type) {
    case LossType::huber:
      return 1.345;
    case LossType::cauchy:
      return 2.385;
    case LossType::tukey:
      return 4.685;
    case LossType::squared:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

LossValue Loss::at(double z_squared) const {
  const double s2 = s() * s(), x = z_squared;
  switch (type) {
    case LossType::huber: {
      if (x <= s2) break;
      const double z = std::sqrt(x), rho1 = s() / z;
      return {2 * s() * z - s2, rho1, -rho1 / (2 * x)};
    }
    case LossType::cauchy: {
      const double inverse = 1 / (1 + x / s2);
      return {s2 * std::log1p(x / s2), inverse, -inverse * inverse / s2};
    }
    case LossType::tukey: {
      if (x > s2) return {s2 / 3, 0, 0};
      const double left = 1 - x / s2;
      return {s2 / 3 * (1 - left * left * left), left * left, -2 * left / s2};
    }
    case LossType::squared:
      break;
  }
  return {x, 1, 0};
}

}  // namespace mbsopt::inline optim
