#include "core/force/friction_law.hpp"

#include <cmath>

namespace mbsopt {

double FrictionLaw::value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  const auto [w, fall, level] = parts(rate);
  return level * rate / w + viscous * rate;
}

Law::Value FrictionLaw::derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  const auto [w, fall, level] = parts(rate);
  const double level_rate = -2 * (breakaway - coulomb) * fall * rate / (stribeck * stribeck);
  return {level * rate / w + viscous * rate, 0,
          level * smooth * smooth / (w * w * w) + level_rate * rate / w + viscous};
}

void FrictionLaw::add_field_gradient(double, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                                     Eigen::VectorXd&) const {
  if (slot >= 0) theta_bar.segment<kFields>(slot) += f_bar * field_gradient(rate);
}

FrictionLaw::Parts FrictionLaw::parts(double rate) const {
  const double fall = std::exp(-(rate / stribeck) * (rate / stribeck));
  return {std::sqrt(rate * rate + smooth * smooth), fall, coulomb + (breakaway - coulomb) * fall};
}

Vec<FrictionLaw::kFields> FrictionLaw::field_gradient(double rate) const {
  const auto [w, fall, level] = parts(rate);
  const double level_stribeck = 2 * (breakaway - coulomb) * fall * rate * rate / (stribeck * stribeck * stribeck);
  Vec<kFields> gradient;
  gradient << (1 - fall) * rate / w, -level * rate * smooth / (w * w * w), rate, fall * rate / w,
      level_stribeck * rate / w;
  return gradient;
}

}  // namespace mbsopt
