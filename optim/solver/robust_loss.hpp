// Loss functions of least squares: the weight of a residual z. The fit minimises 1/2 sum rho(z^2).
//
//   squared   z^2
//   huber     z^2 where |z| <= s, else 2 s |z| - s^2              gross errors pull with a constant force
//   cauchy    s^2 log(1 + z^2/s^2)                                with one that falls off as 1/|z|
//   tukey     s^2/3 (1 - (1 - z^2/s^2)^3) where |z| <= s, else s^2/3        not at all beyond s
//
// All are z^2 near 0. The default s keeps 95 % of the efficiency if the noise is normal: 1.345, 2.385, 4.685 (Holland
// and Welsch, Communications in Statistics A6 (1977) 813).
//
//   const Loss loss{LossType::huber};
//   const LossValue v = loss.at(z * z);    // v.rho, v.rho1 = d rho/d(z^2), v.rho2
//   v.rho1 * z;                            // the pull: derivative of 1/2 rho in z
#pragma once

#include <optional>

namespace mbsopt::inline optim {

enum class LossType { squared, huber, cauchy, tukey };

double usual_scale(LossType type);  // infinite for squared

struct LossValue {
  double rho = 0, rho1 = 1, rho2 = 0;  // with its derivatives in z^2
};

struct Loss {
  LossType type = LossType::squared;
  std::optional<double> scale = {};  // s, in units of sigma, > 0

  double s() const { return scale.value_or(usual_scale(type)); }
  LossValue at(double z_squared) const;
};

}  // namespace mbsopt::inline optim
