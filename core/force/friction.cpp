#include "core/force/friction.hpp"

#include <cmath>

namespace mbsopt {

double FrictionLaw::value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  const Parts at = parts(rate);
  return at.level * at.u + viscous * rate;
}

Law::Value FrictionLaw::derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  const auto [w, u, s, fall, level, bulge] = parts(rate);
  return {level * u + viscous * rate, 0, (level * s * s - bulge) / w + viscous};
}

void FrictionLaw::add_field_gradient(double, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                                     Eigen::VectorXd&) const {
  if (slot >= 0) theta_bar.segment<kFields>(slot) += f_bar * field_gradient(rate);
}

FrictionLaw::Parts FrictionLaw::parts(double rate) const {
  const double w = std::hypot(rate, smooth), x = rate / stribeck, fall = std::exp(-x * x);
  const double x_fall = fall > 0 ? x * fall * x : 0;  // x^2 overflows where the exponential vanishes
  return {w, rate / w, smooth / w, fall, coulomb + (breakaway - coulomb) * fall, 2 * (breakaway - coulomb) * x_fall};
}

Vec<FrictionLaw::kFields> FrictionLaw::field_gradient(double rate) const {
  const auto [w, u, s, fall, level, bulge] = parts(rate);
  Vec<kFields> gradient;
  gradient << (1 - fall) * u, -level * u * s / w, rate, fall * u, bulge / stribeck * u;
  return gradient;
}

}  // namespace mbsopt
