#include "optim/problem/variable_scaling.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace mbsopt::inline optim {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

void check(const Parameter& p) {
  const double lower = p.lower.value_or(-kInfinity), upper = p.upper.value_or(kInfinity);
  if (!std::isfinite(p.value)) throw std::invalid_argument(fmt::format("parameters.{}.value: is not finite", p.name));
  if (lower > upper)
    throw std::invalid_argument(fmt::format("parameters.{}: lower is {}, above upper {}", p.name, lower, upper));
  if (p.value < lower || p.value > upper)
    throw std::invalid_argument(
        fmt::format("parameters.{}.value: is {}, outside its bounds {} to {}", p.name, p.value, lower, upper));
  if (p.scale == ParameterScale::linear) return;
  if (p.value <= 0 || (p.lower && *p.lower <= 0))
    throw std::invalid_argument(
        fmt::format("parameters.{}: a logarithmic scale needs a value and a lower bound above 0, found value {}{}",
                    p.name, p.value, p.lower ? fmt::format(", lower {}", *p.lower) : ""));
}

double range_of(const Parameter& p) { return p.upper.value_or(kInfinity) - p.lower.value_or(-kInfinity); }

double linear_scale(const Parameter& p, double felt) {
  const double size = std::abs(p.value), range = range_of(p), reach = std::min(range / kWideRange, felt);
  const bool info = size > 0 && kWideRange * size >= std::min(range, felt);
  return info ? size : reach > 0 && std::isfinite(reach) ? reach : size > 0 ? size : 1;
}

}  // namespace

double VariableScaling::Variable::to_x(double rho) const {
  return scale == ParameterScale::linear ? rho / s : scale == ParameterScale::log ? std::log(rho) : std::log10(rho);
}

double VariableScaling::Variable::to_rho(double x) const {
  return scale == ParameterScale::linear ? s * x : scale == ParameterScale::log ? std::exp(x) : std::pow(10, x);
}

// d rho/dx = a rho on a logarithmic scale
double VariableScaling::Variable::rho_x(double x) const {
  const double a = scale == ParameterScale::log ? 1 : std::numbers::ln10;
  return scale == ParameterScale::linear ? s : a * to_rho(x);
}

double VariableScaling::Variable::rho_xx(double x) const {
  const double a = scale == ParameterScale::log ? 1 : std::numbers::ln10;
  return scale == ParameterScale::linear ? 0 : a * a * to_rho(x);
}

bool is_scaled_by_range(const Parameter& p) {
  const bool is_within = p.lower && p.upper && std::abs(p.value) < range_of(p) / kWideRange;
  return p.scale == ParameterScale::linear && (is_within || p.value == 0);
}

VariableScaling::VariableScaling(const std::vector<Parameter>& parameters, const Eigen::VectorXd& felt) {
  const Eigen::Index n = static_cast<Eigen::Index>(parameters.size());
  x_lower_.setConstant(n, -kInfinity);
  x_upper_.setConstant(n, kInfinity);
  rho_lower_.setConstant(n, -kInfinity);
  rho_upper_.setConstant(n, kInfinity);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Parameter& p = parameters[static_cast<std::size_t>(k)];
    check(p);
    const Variable variable{p.scale, linear_scale(p, felt.size() > 0 ? felt(k) : kInfinity)};
    if (p.lower) {
      rho_lower_(k) = *p.lower;
      x_lower_(k) = variable.to_x(*p.lower);
    }
    if (p.upper) {
      rho_upper_(k) = *p.upper;
      x_upper_(k) = variable.to_x(*p.upper);
    }
    variables_.push_back(variable);
  }
}

Eigen::VectorXd VariableScaling::each(double (Variable::*map)(double) const, const Eigen::VectorXd& of) const {
  Eigen::VectorXd mapped(size());
  for (Eigen::Index k = 0; k < size(); ++k) mapped(k) = (variables_[static_cast<std::size_t>(k)].*map)(of(k));
  return mapped;
}

Eigen::VectorXd VariableScaling::to_x(const Eigen::VectorXd& rho) const { return each(&Variable::to_x, rho); }
Eigen::VectorXd VariableScaling::to_rho(const Eigen::VectorXd& x) const {
  return each(&Variable::to_rho, x).cwiseMax(rho_lower_).cwiseMin(rho_upper_);
}
Eigen::VectorXd VariableScaling::rho_x(const Eigen::VectorXd& x) const { return each(&Variable::rho_x, x); }
Eigen::VectorXd VariableScaling::rho_xx(const Eigen::VectorXd& x) const { return each(&Variable::rho_xx, x); }

}  // namespace mbsopt::inline optim
