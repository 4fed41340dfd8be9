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
  switch (scale) {
    case ParameterScale::log:
      return std::log(rho);
    case ParameterScale::log10:
      return std::log10(rho);
    case ParameterScale::linear:
      break;
  }
  return rho / s;
}

double VariableScaling::Variable::to_rho(double x) const {
  switch (scale) {
    case ParameterScale::log:
      return std::exp(x);
    case ParameterScale::log10:
      return std::pow(10, x);
    case ParameterScale::linear:
      break;
  }
  return s * x;
}

double VariableScaling::Variable::rho_x(double x) const {
  switch (scale) {
    case ParameterScale::log:
      return std::exp(x);
    case ParameterScale::log10:
      return std::numbers::ln10 * std::pow(10, x);
    case ParameterScale::linear:
      break;
  }
  return s;
}

double VariableScaling::Variable::rho_xx(double x) const {
  switch (scale) {
    case ParameterScale::log:
      return std::exp(x);
    case ParameterScale::log10:
      return std::numbers::ln10 * std::numbers::ln10 * std::pow(10, x);
    case ParameterScale::linear:
      break;
  }
  return 0;
}

bool is_scaled_by_range(const Parameter& p) {
  const bool is_within = p.lower && p.upper && std::abs(p.value) < range_of(p) / kWideRange;
  return p.scale == ParameterScale::linear && (is_within || p.value == 0);
}

VariableScaling::VariableScaling(const std::vector<Parameter>& parameters, const Eigen::VectorXd& felt) {
  const Eigen::Index n = static_cast<Eigen::Index>(parameters.size());
  x_lower_.setConstant(n, -kInfinity), x_upper_.setConstant(n, kInfinity);
  rho_lower_.setConstant(n, -kInfinity), rho_upper_.setConstant(n, kInfinity);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Parameter& p = parameters[static_cast<std::size_t>(k)];
    check(p);
    const Variable variable{p.scale, linear_scale(p, felt.size() > 0 ? felt(k) : kInfinity)};
    if (p.lower) rho_lower_(k) = *p.lower, x_lower_(k) = variable.to_x(*p.lower);
    if (p.upper) rho_upper_(k) = *p.upper, x_upper_(k) = variable.to_x(*p.upper);
    variables_.push_back(variable);
  }
}

Eigen::VectorXd VariableScaling::to_x(const Eigen::VectorXd& rho) const {
  Eigen::VectorXd x(size());
  for (Eigen::Index k = 0; k < size(); ++k) x(k) = variables_[static_cast<std::size_t>(k)].to_x(rho(k));
  return x;
}

Eigen::VectorXd VariableScaling::to_rho(const Eigen::VectorXd& x) const {
  Eigen::VectorXd rho(size());
  for (Eigen::Index k = 0; k < size(); ++k) rho(k) = variables_[static_cast<std::size_t>(k)].to_rho(x(k));
  return rho.cwiseMax(rho_lower_).cwiseMin(rho_upper_);
}

Eigen::VectorXd VariableScaling::rho_x(const Eigen::VectorXd& x) const {
  Eigen::VectorXd d(size());
  for (Eigen::Index k = 0; k < size(); ++k) d(k) = variables_[static_cast<std::size_t>(k)].rho_x(x(k));
  return d;
}

Eigen::VectorXd VariableScaling::rho_xx(const Eigen::VectorXd& x) const {
  Eigen::VectorXd d(size());
  for (Eigen::Index k = 0; k < size(); ++k) d(k) = variables_[static_cast<std::size_t>(k)].rho_xx(x(k));
  return d;
}

}  // namespace mbsopt::inline optim
