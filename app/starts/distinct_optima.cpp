#include "app/starts/distinct_optima.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "app/results/joint_forces.hpp"
#include "core/body/euler_parameters.hpp"
#include "optim/problem/parameter_values.hpp"
#include "optim/problem/variable_scaling.hpp"

namespace mbsopt::inline app {
namespace {

constexpr double kSameOptimum = 1e-3;  // of the range of a parameter, in its scale

// Numbers of one kind agree to the accuracy at which searches end. All may be rounding, as forces without gravity are.
bool same_numbers(const Json& a, const Json& b) {
  constexpr double kSearched = 1e-4, kRounding = 1e-12;
  const auto u = a.get<std::vector<double>>(), v = b.get<std::vector<double>>();
  if (u.size() != v.size()) return false;
  double size = 0, apart = 0;
  for (std::size_t i = 0; i < u.size(); ++i)
    size = std::max(size, std::abs(u[i])), apart = std::max(apart, std::abs(u[i] - v[i]));
  return apart <= kSearched * size + kRounding;
}

bool same_motion(const Json& a, const Json& b) {
  if (!a.contains("motion") || !b.contains("motion")) return false;
  for (std::size_t c = 0; c < a["motion"].size(); ++c) {
    if (a["motion"][c].is_null() || b["motion"][c].is_null()) return false;
    for (const auto& [kind, numbers] : a["motion"][c].items())
      if (!same_numbers(numbers, b["motion"][c].at(kind))) return false;
  }
  return true;
}

bool same_parameters(const Json& a, const Json& b, const Scene& scene) {
  for (const auto& [name, value] : a["parameters"].items()) {
    if (!b["parameters"].contains(name)) return false;
    const auto parameter = std::find_if(scene.parameters.begin(), scene.parameters.end(),
                                        [&, key = name](const Parameter& p) { return p.name == key; });
    if (parameter == scene.parameters.end() || !parameter->lower || !parameter->upper) continue;
    const VariableScaling scaling({*parameter});
    const auto x = [&](const Json& rho) { return scaling.to_x(Eigen::VectorXd::Constant(1, rho.get<double>()))(0); };
    const double there = x(value), here = x(b["parameters"][name]);
    double range = scaling.x_upper()(0) - scaling.x_lower()(0);
    if (parameter->scale == ParameterScale::linear && parameter->value != 0)  // bounds may be wide
      range = std::min(range, kWideRange * std::max({std::abs(there), std::abs(here), std::abs(x(parameter->value))}));
    if (std::abs(there - here) > kSameOptimum * range) return false;
  }
  return true;
}

}  // namespace

Json motion_of(const Scene& scene) {
  const Eigen::VectorXd rho = parameter_values(scene);
  const Mechanism mechanism(scene, rho, std::vector<bool>(scene.parameters.size(), false));
  const double start = scene.simulation.start_time, span = scene.simulation.end_time - start;
  std::vector<double> origins, axes, joint_forces;
  Sampling sampling{{start, start + 0.4 * span, start + 0.9 * span}, {}};
  JointForces forces(scene, rho, sampling.times.size());
  sampling.observe = [&](std::size_t i, const StatePoint& at) {
    for (int body = 0; body < mechanism.bodies(); ++body) {
      const Eigen::Matrix<double, 13, 1> row = body_row(mechanism, body, at);
      const Matrix3d R = A(row.segment<4>(3));
      origins.insert(origins.end(), row.begin(), row.begin() + 3);
      axes.insert(axes.end(), R.data(), R.data() + 6);
    }
    forces.observe(i, at);
    const std::vector<double>& row = forces.table().rows.back();
    joint_forces.insert(joint_forces.end(), row.begin() + 1, row.end());
  };
  if (!simulate(mechanism, scene.simulation, {}, sampling).ok()) return {};
  if (!std::ranges::all_of(joint_forces, [](double force) { return std::isfinite(force); })) return {};
  return {{"origins", origins}, {"axes", axes}, {"forces", joint_forces}};
}

bool is_an_optimum(const Json& record) {
  const std::string status = record.value("status", "");
  return status.starts_with("converged") && record["objective"].is_number() &&
         record.value("infeasibility", 0.0) <= kFeasible;
}

bool same_optimum(const Json& a, const Json& b, const Scene& scene) {
  // Parameters may cost something without any effect on the motion.
  const auto objective = [](const Json& record) { return Json::array({record["objective"]}); };
  return same_parameters(a, b, scene) || (same_numbers(objective(a), objective(b)) && same_motion(a, b));
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

}  // namespace mbsopt::inline app
