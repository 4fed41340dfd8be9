#include "app/starts/distinct_optima.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "core/expression/dimension.hpp"
#include "optim/problem/variable_scaling.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kSameOptimum = 1e-3;    // of the range of a parameter, in its scale
constexpr double kSameObjective = 1e-4;  // relative: the accuracy at which searches end

bool may_be_angle(const Parameter& p) {
  const std::optional<Unit> unit = parse_unit(p.unit);
  return p.scale == ParameterScale::linear && (p.unit.empty() || (unit && unit->dimension == dimension::kAngle));
}

}  // namespace

bool is_an_optimum(const Json& record) {
  const std::string status = record.value("status", "");
  return status.starts_with("converged") && record["objective"].is_number() &&
         record.value("infeasibility", 0.0) <= kFeasible;
}

bool same_optimum(const Json& a, const Json& b, const Scene& scene) {
  bool are_turned = false;
  for (const auto& [name, value] : a["parameters"].items()) {
    if (!b["parameters"].contains(name)) return false;
    const auto parameter = std::ranges::find(scene.parameters, name, &Parameter::name);
    if (parameter == scene.parameters.end() || !parameter->lower || !parameter->upper) continue;
    const VariableScaling scaling({*parameter});
    const auto x = [&](const Json& rho) { return scaling.to_x(Eigen::VectorXd::Constant(1, rho.get<double>()))(0); };
    const double there = x(value), here = x(b["parameters"][name]);
    double range = scaling.x_upper()(0) - scaling.x_lower()(0);
    if (parameter->scale == ParameterScale::linear && parameter->value != 0)  // bounds may be wide
      range = std::min(range, kWideRange * std::max({std::abs(there), std::abs(here), std::abs(x(parameter->value))}));
    if (std::abs(there - here) <= kSameOptimum * range) continue;
    if (!may_be_angle(*parameter)) return false;
    const double turn = x(2 * std::numbers::pi) - x(0);
    if (std::abs(std::remainder(there - here, turn)) > kSameOptimum * range) return false;
    are_turned = true;
  }
  const double f = a["objective"].get<double>(), g = b["objective"].get<double>();
  return !are_turned || std::abs(f - g) <= kSameObjective * std::abs(f) + 1e-12;
}

std::vector<DistinctOptimum> distinct_optima(const std::vector<Json>& ranked, const Scene& scene) {
  std::vector<DistinctOptimum> optima;
  for (const Json& record : ranked) {
    if (!is_an_optimum(record)) continue;
    const auto same =
        std::ranges::find_if(optima, [&](const DistinctOptimum& o) { return same_optimum(*o.best, record, scene); });
    if (same == optima.end())
      optima.push_back({&record, 1});
    else
      ++same->starts;
  }
  return optima;
}

std::optional<double> SearchedOptima::expected() const {
  const double n = static_cast<double>(searches), w = static_cast<double>(optima);
  if (n <= w + 2) return std::nullopt;
  return w * (n - 1) / (n - w - 2);
}

double SearchedOptima::covered() const {
  const double n = static_cast<double>(searches), w = static_cast<double>(optima);
  return n > 1 ? (n - w - 1) * (n + w) / (n * (n - 1)) : 0;
}

SearchedOptima searched(const std::vector<DistinctOptimum>& optima) {
  SearchedOptima found;
  for (const DistinctOptimum& o : optima) {
    found.searches += o.starts;
    ++found.optima;
  }
  return found;
}

bool all_found(const std::vector<Json>& ranked, const Scene& scene) {
  std::map<long, std::vector<Json>> by_mode;
  for (const Json& record : ranked) {
    if (!record["objective"].is_number()) continue;
    by_mode[record.contains("assembly_mode") ? record["assembly_mode"]["mode"].get<long>() : 0].push_back(record);
  }
  return !by_mode.empty() && std::ranges::all_of(by_mode, [&](const auto& mode) {
    return searched(distinct_optima(mode.second, scene)).all_found();
  });
}

}  // namespace mbsopt::inline app
