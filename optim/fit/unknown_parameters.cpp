#include "optim/fit/unknown_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt {
namespace {

bool has_override(const ExperimentSpec& spec, const std::string& name, double* value = nullptr) {
  for (const auto& [overridden, number] : spec.overrides) {
    if (overridden != name) continue;
    if (value) *value = number;
    return true;
  }
  return false;
}

}  // namespace

std::string place_of(const IdentificationSpec& spec, std::size_t experiment) {
  const std::string& place = spec.experiments[experiment].place;
  return place.empty() ? fmt::format("identification.experiments[{}]", experiment) : place;
}

const std::string& record_name(const ExperimentSpec& experiment) {
  return experiment.origin ? experiment.origin->experiment : experiment.name;
}

bool is_held(const Parameter& p) {
  constexpr double kSame = 1e-12;  // of the bounds: nearer ones may be equal in the scaled variables of the solver
  return p.lower && p.upper && *p.upper - *p.lower <= kSame * std::max(std::abs(*p.lower), std::abs(*p.upper));
}

std::vector<UnknownParameter> free_in(const Scene& scene, const IdentificationSpec& spec, std::size_t experiment) {
  const ExperimentSpec& here = spec.experiments[experiment];
  std::vector<UnknownParameter> unknowns;
  if (here.free.empty()) return unknowns;
  for (const int k : parameter_indices(scene, here.free)) {
    UnknownParameter u{k, experiment, false, scene.parameters[static_cast<std::size_t>(k)]};
    has_override(here, u.description.name, &u.description.value);  // starts there
    if (!is_held(u.description)) unknowns.push_back(std::move(u));
  }
  return unknowns;
}

std::vector<UnknownParameter> unknowns_of_fit(const Scene& scene, const IdentificationSpec& spec) {
  std::vector<UnknownParameter> unknowns;
  if (!spec.variables.empty())
    for (const int k : parameter_indices(scene, spec.variables)) {
      UnknownParameter u{k, 0, true, scene.parameters[static_cast<std::size_t>(k)]};
      const auto uses_it = [&](const ExperimentSpec& e) {
        const bool freed = std::find(e.free.begin(), e.free.end(), u.description.name) != e.free.end();
        return !e.validate && !freed && !has_override(e, u.description.name);
      };
      if (std::none_of(spec.experiments.begin(), spec.experiments.end(), uses_it))
        throw std::invalid_argument(fmt::format(
            "identification.variables: '{}' is free or overridden in every fitted experiment", u.description.name));
      if (!is_held(u.description)) unknowns.push_back(std::move(u));
    }
  for (std::size_t e = 0; e < spec.experiments.size(); ++e) {
    if (spec.experiments[e].validate) continue;
    for (UnknownParameter& u : free_in(scene, spec, e)) unknowns.push_back(std::move(u));
  }
  if (unknowns.empty())
    throw std::invalid_argument(spec.variables.empty()
                                    ? "identification.variables: is empty; name what is to be fitted"
                                    : "identification.variables: none of them can change: their lower bounds are their "
                                      "upper bounds");
  return unknowns;
}

std::vector<Experiment::Unknown> unknowns_in(const Scene& scene, const IdentificationSpec& spec, std::size_t experiment,
                                             const std::vector<UnknownParameter>& unknowns) {
  std::vector<Experiment::Unknown> here;
  const std::vector<UnknownParameter> freed = free_in(scene, spec, experiment);
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const UnknownParameter& u = unknowns[i];
    const bool is_free =
        std::any_of(freed.begin(), freed.end(), [&](const auto& f) { return f.parameter == u.parameter; });
    const bool overridden = has_override(spec.experiments[experiment], u.description.name);
    if (u.shared ? !is_free && !overridden : u.experiment == experiment)
      here.push_back({u.parameter, static_cast<Eigen::Index>(i)});
  }
  return here;
}

std::string name_of(const UnknownParameter& unknown, const IdentificationSpec& spec) {
  const std::string& name = unknown.description.name;
  return unknown.shared ? name : spec.experiments[unknown.experiment].name + "." + name;
}

std::vector<std::string> names_of(const std::vector<UnknownParameter>& unknowns, const IdentificationSpec& spec) {
  std::vector<std::string> names;
  for (const UnknownParameter& u : unknowns) names.push_back(name_of(u, spec));
  return names;
}

VariableScaling scaling_of(const std::vector<UnknownParameter>& unknowns) {
  std::vector<Parameter> parameters;
  for (const UnknownParameter& u : unknowns) parameters.push_back(u.description);
  return VariableScaling(parameters);
}

Eigen::VectorXd start_of(const std::vector<UnknownParameter>& unknowns) {
  Eigen::VectorXd u(static_cast<Eigen::Index>(unknowns.size()));
  for (Eigen::Index k = 0; k < u.size(); ++k) u(k) = unknowns[static_cast<std::size_t>(k)].description.value;
  return u;
}

}  // namespace mbsopt
