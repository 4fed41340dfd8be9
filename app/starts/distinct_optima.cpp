#include "app/starts/distinct_optima.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "optim/problem/variable_scaling.hpp"

namespace mbsopt {
namespace {

constexpr double kSameOptimum = 1e-3;  // of the range of a parameter, in its scale

}  // namespace

bool is_an_optimum(const Json& record) {
  const std::string status = record.value("status", "");
  return status.starts_with("converged") && record["objective"].is_number() &&
         record.value("infeasibility", 0.0) <= kFeasible;
}

bool same_optimum(const Json& a, const Json& b, const Scene& scene) {
  for (const auto& [name, value] : a["parameters"].items()) {
    if (!b["parameters"].contains(name)) return false;
    const auto parameter = std::find_if(scene.parameters.begin(), scene.parameters.end(),
                                        [&, key = name](const Parameter& p) { return p.name == key; });
    if (parameter == scene.parameters.end() || !parameter->lower || !parameter->upper) continue;
    const VariableScaling scaling({*parameter});
    const auto x = [&](const Json& rho) { return scaling.to_x(Eigen::VectorXd::Constant(1, rho.get<double>()))(0); };
    const double range = scaling.x_upper()(0) - scaling.x_lower()(0);
    if (std::abs(x(value) - x(b["parameters"][name])) > kSameOptimum * range) return false;
  }
  return true;
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
  for (const DistinctOptimum& o : optima) found.searches += o.starts, ++found.optima;
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

}  // namespace mbsopt
