#include "app/results/optimized_problem.hpp"

#include <fmt/format.h>

#include <filesystem>
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

}  // namespace

std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values,
                                   const std::vector<Body>& poses) {
  const Problem& problem = run.problem;
  std::string text = read_text_file(run.context.options.problem_file);
  for (const std::string& set : run.context.options.sets) text = with_override(text, set);
  std::map<std::string, double> of_parameters;
  for (const NewValue& v : values) {
    if (v.experiment.empty()) of_parameters[v.parameter] = v.value;
  }
  text = with_parameter_values(text, of_parameters);
  // The values of parameters in one experiment are its overrides.
  for (const NewValue& v : values) {
    for (std::size_t i = 0; problem.identification && i < problem.identification->experiments.size(); ++i) {
      if (v.experiment != problem.identification->experiments[i].name) continue;
      const std::string place = child_path("identification.experiments", i);
      text = with_override(text, fmt::format("{}.overrides.{}={}", place, v.parameter, v.value));
    }
  }
  // File names are relative to the folder of the text.
  for (const NamedFiles& named : named_files(problem)) {
    Json moved = Json::array();
    for (const std::string& file : named.files)
      moved.push_back(std::filesystem::relative(file, std::filesystem::canonical(run.folder.path())).generic_string());
    text = with_value(text, named.path, json_text(named.is_list ? moved : moved[0]));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string body = child_path("bodies", i);
    text = with_value(text, body + ".position", json_text(json_of(poses[i].position)));
    text = with_value(text, body + ".orientation", json_text(json_of(poses[i].orientation)));
  }
  return text;
}

}  // namespace mbsopt
