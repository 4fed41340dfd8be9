#include "app/results/optimized_problem.hpp"

#include <fmt/format.h>

#include <map>

#include "app/files/json_text.hpp"
#include "app/json/edit_text.hpp"
#include "app/json/source_text.hpp"
#include "app/run/run.hpp"
#include "core/scene/scene_path.hpp"

namespace mbsopt {
namespace {

Json json_of(const Field& field) { return field.is_number() ? Json(field.number()) : Json(field.text()); }
template <std::size_t N>
Json json_of(const std::array<Field, N>& fields) {
  Json json = Json::array();
  for (const Field& field : fields) json.push_back(json_of(field));
  return json;
}
Json json_of(const OrientationField& field) {
  if (const auto* const e = std::get_if<EulerParametersField>(&field)) return json_of(e->e);
  if (const auto* const a = std::get_if<AxisAngleField>(&field))
    return {{"axis", json_of(a->axis)}, {"angle", json_of(a->angle)}};
  return {{"rpy", json_of(std::get<RollPitchYawField>(field).rpy)}};
}

std::string experiment_path(std::size_t index) { return child_path("identification.experiments", index); }

// Writes the values of parameters in one experiment as its overrides.
std::string with_experiment_values(std::string text, const Problem& problem, const std::vector<NewValue>& values) {
  for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
    for (const NewValue& v : values) {
      if (v.experiment != problem.identification->experiments[i].name) continue;
      text = with_override(text, fmt::format("{}.overrides.{}={}", experiment_path(i), v.parameter, v.value));
    }
  }
  return text;
}

}  // namespace

std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values,
                                   const std::vector<Body>& poses) {
  const CommandOptions& options = run.context.options;
  std::string text = optimized_problem_text(options.problem_file, options.sets, run.problem, values, run.folder.path());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string body = child_path("bodies", i);
    text = with_value(text, body + ".position", json_text(json_of(poses[i].position)));
    text = with_value(text, body + ".orientation", json_text(json_of(poses[i].orientation)));
  }
  return text;
}

std::string optimized_problem_text(const std::string& problem_file, const std::vector<std::string>& sets,
                                   const Problem& problem, const std::vector<NewValue>& values,
                                   const std::filesystem::path& folder) {
  std::string text = read_text_file(problem_file);
  for (const std::string& set : sets) text = with_override(text, set);
  std::map<std::string, double> of_parameters;
  for (const NewValue& v : values) {
    if (v.experiment.empty()) of_parameters[v.parameter] = v.value;
  }
  text = with_parameter_values(text, of_parameters);
  // File names are relative to the folder of the text.
  const auto relative_to_folder = [&](const std::string& file) {
    return std::filesystem::relative(file, std::filesystem::canonical(folder)).generic_string();
  };
  const auto moved = [&](const std::string& path, const std::string& file) {
    text = with_value(text, path, json_text(relative_to_folder(file)));
  };
  const auto moved_law = [&](const std::string& place, const std::optional<SampledLaw>& law) {
    if (law) moved(place + ".law.csv", law->file);
  };
  if (!problem.plugins.empty()) {
    Json plugins = Json::array();
    for (const std::string& file : problem.plugins) plugins.push_back(relative_to_folder(file));
    text = with_value(text, "plugins", json_text(plugins));
  }
  const std::vector<Drive>& drives = problem.scene.drives;
  const auto laws_moved = [&](const std::vector<DriveLaw>& laws, const std::string& owner) {
    for (std::size_t k = 0; k < laws.size(); ++k) moved_law(child_path(owner + ".drives", k), laws[k].samples);
  };
  const auto signals_moved = [&](const std::vector<SignalSamples>& all, const std::string& owner) {
    for (const SignalSamples& samples : all)
      moved(child_path(owner + ".signals", samples.name) + ".file", samples.file);
  };
  for (std::size_t i = 0; i < drives.size(); ++i) moved_law(child_path("drives", i), drives[i].samples);
  for (const Signal& signal : problem.scene.signals) moved(child_path("signals", signal.name) + ".file", signal.file);
  for (const ObjectiveSpec& objective : problem.objectives)
    for (std::size_t k = 0; k < objective.track.size(); ++k)
      moved(child_path(child_path("objectives", objective.name) + ".track", k) + ".file", objective.track[k].file);
  for (std::size_t c = 0; c < problem.cases.size(); ++c) {
    laws_moved(problem.cases[c].drives, child_path("cases", c));
    signals_moved(problem.cases[c].signals, child_path("cases", c));
  }
  if (!problem.identification) return text;
  text = with_experiment_values(std::move(text), problem, values);
  for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
    const ExperimentSpec& experiment = problem.identification->experiments[i];
    const std::string place = experiment_path(i);
    Json data = Json::array();
    for (const std::string& file : experiment.data) data.push_back(relative_to_folder(file));
    text = with_value(text, place + ".data", json_text(data.size() == 1 ? data[0] : data));
    laws_moved(experiment.drives, place);
    signals_moved(experiment.signals, place);
  }
  return text;
}

}  // namespace mbsopt
