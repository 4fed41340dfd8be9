#include "optim/fit/unknown_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

// The value that an experiment gives a parameter; null if it gives none.
const double* override_of(const ExperimentSpec& spec, const std::string& name) {
  const auto found = std::ranges::find(spec.overrides, name, &std::pair<std::string, double>::first);
  return found == spec.overrides.end() ? nullptr : &found->second;
}

}  // namespace

std::string place_of(const IdentificationSpec& spec, std::size_t experiment) {
  const std::string& place = spec.experiments[experiment].place;
  return place.empty() ? fmt::format("identification.experiments[{}]", experiment) : place;
}

const std::string& record_name(const ExperimentSpec& experiment) {
  return experiment.origin ? experiment.origin->experiment : experiment.name;
}

RecordChannels record_channels(const IdentificationSpec& spec) {
  RecordChannels channels;
  for (std::size_t e = 0; e < spec.experiments.size(); ++e) {
    const ExperimentSpec& experiment = spec.experiments[e];
    const bool is_next_window = e > 0 && record_name(experiment) == record_name(spec.experiments[e - 1]);
    channels.first.push_back(is_next_window ? channels.first.back() : channels.all.size());
    for (std::size_t c = 0; !is_next_window && c < experiment.channels.size(); ++c) channels.all.push_back({e, c});
  }
  return channels;
}

void set_override(ExperimentSpec& experiment, const std::string& parameter, double value) {
  std::erase_if(experiment.overrides, [&](const auto& given) { return given.first == parameter; });
  experiment.overrides.emplace_back(parameter, value);
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
    if (const double* value = override_of(here, u.description.name)) u.description.value = *value;  // starts there
    if (!is_held(u.description)) unknowns.push_back(std::move(u));
  }
  return unknowns;
}

std::vector<UnknownParameter> unknowns_of_fit(const Scene& scene, const IdentificationSpec& spec) {
  std::vector<UnknownParameter> unknowns;
  if (!spec.variables.empty())
    for (const int k : parameter_indices(scene, spec.variables)) {
      UnknownParameter u{k, 0, true, scene.parameters[static_cast<std::size_t>(k)]};
      const std::string& name = u.description.name;
      const auto uses_it = [&](const ExperimentSpec& e) {
        return !e.validate && std::ranges::find(e.free, name) == e.free.end() && !override_of(e, name);
      };
      if (std::ranges::none_of(spec.experiments, uses_it))
        throw std::invalid_argument(
            fmt::format("identification.variables: '{}' is free or overridden in every fitted experiment", name));
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
    const bool is_free = std::ranges::find(freed, u.parameter, &UnknownParameter::parameter) != freed.end();
    const bool overridden = override_of(spec.experiments[experiment], u.description.name) != nullptr;
    if (u.shared ? !is_free && !overridden : u.experiment == experiment)
      here.push_back({u.parameter, static_cast<Eigen::Index>(i)});
  }
  return here;
}

std::string name_of(const UnknownParameter& unknown, const IdentificationSpec& spec) {
  const std::string& name = unknown.description.name;
  return unknown.shared ? name : spec.experiments[unknown.experiment].name + "." + name;
}

Eigen::VectorXd start_of(const std::vector<UnknownParameter>& unknowns) {
  Eigen::VectorXd u(static_cast<Eigen::Index>(unknowns.size()));
  for (Eigen::Index k = 0; k < u.size(); ++k) u(k) = unknowns[static_cast<std::size_t>(k)].description.value;
  return u;
}

}  // namespace mbsopt::inline optim
