#include "core/force/law.hpp"

#include <algorithm>

namespace mbsopt {

double Law::value(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const {
  if (!program) return k * (x - x0) + c * xdot + f0;
  set_inputs(t, rho, x, xdot, s);
  return program->value(s.inputs, s.program);
}

Law::Value Law::derivatives(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const {
  if (!program) return {k * (x - x0) + c * xdot + f0, k, c};
  set_inputs(t, rho, x, xdot, s);
  std::fill(s.gradient.begin(), s.gradient.end(), 0.0);
  const double f = program->add_gradient(s.inputs, 1.0, s.gradient, s.program);
  const std::size_t P = static_cast<std::size_t>(rho.size());
  return {f, s.gradient[P], s.gradient[P + 1]};
}

Vec<4> Law::field_gradient(double x, double xdot) const { return {x - x0, xdot, -k, 1}; }

Vec<4> Law::potential_gradient(double x) const {
  if (program) return Vec<4>::Zero();
  const double stretch = x - x0;
  return {0.5 * stretch * stretch, 0, -k * stretch, 0};
}

void Law::add_field_gradient(double x, double xdot, double f_bar, const Scratch& s, Eigen::VectorXd& theta_bar,
                             Eigen::VectorXd& rho_bar) const {
  if (program) {
    for (Eigen::Index i = 0; i < rho_bar.size(); ++i) rho_bar(i) += f_bar * s.gradient[static_cast<std::size_t>(i)];
  } else if (slot >= 0) {
    theta_bar.segment<4>(slot) += f_bar * field_gradient(x, xdot);
  }
}

void Law::set_inputs(double t, const Eigen::VectorXd& rho, double x, double xdot, Scratch& s) const {
  std::copy(rho.data(), rho.data() + rho.size(), s.inputs.begin());
  const std::size_t P = static_cast<std::size_t>(rho.size());
  s.inputs[P] = x;
  s.inputs[P + 1] = xdot;
  s.inputs[P + 2] = t;
}

}  // namespace mbsopt
