#include "core/force/friction_law.hpp"

#include <cmath>

namespace mbsopt {

double FrictionLaw::value(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  return coulomb * rate / width(rate) + viscous * rate;
}

Law::Value FrictionLaw::derivatives(double, const Eigen::VectorXd&, double, double rate, Law::Scratch&) const {
  const double w = width(rate);
  return {coulomb * rate / w + viscous * rate, 0, coulomb * smooth * smooth / (w * w * w) + viscous};
}

void FrictionLaw::add_field_gradient(double, double rate, double f_bar, const Law::Scratch&, Eigen::VectorXd& theta_bar,
                                     Eigen::VectorXd&) const {
  if (slot >= 0) theta_bar.segment<3>(slot) += f_bar * field_gradient(rate);
}

double FrictionLaw::width(double rate) const { return std::sqrt(rate * rate + smooth * smooth); }

Vec<3> FrictionLaw::field_gradient(double rate) const {
  const double w = width(rate);
  return {rate / w, -coulomb * rate * smooth / (w * w * w), rate};
}

}  // namespace mbsopt
