#include "app/results/optimized_problem.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>

#include "app/files/json_text.hpp"
#include "app/json/edit_text.hpp"
#include "app/json/source_text.hpp"
#include "app/run/run.hpp"
#include "core/scene/scene_path.hpp"
#include "core/scene/vocabulary.hpp"

namespace mbsopt::inline app {
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

std::string text_of(const Json& object) {
  std::string text;
  for (const auto& [key, value] : object.items())
    text += (text.empty() ? "" : ", ") + json_text(key) + ": " + json_text(value);
  return "{" + text + "}";
}

// A visitor of the vocabulary: writes the fields of settings as in a problem file. An absent field is left out.
class SettingsWriter {
 public:
  Json json = Json::object();

  void plain(std::string_view key, const auto& value, const Range&, const FieldInfo&) { put(key, value); }
  template <class T>
  void plain(std::string_view key, const std::optional<T>& value, const Range&, const FieldInfo&) {
    if (value) put(key, *value);
  }
  void word(std::string_view key, const std::string& value, const Words&, const FieldInfo&) {
    if (!value.empty()) put(key, value);
  }
  void choice(std::string_view key, const auto& value, const auto& choices, const FieldInfo&) {
    for (const auto& choice : choices)
      if (choice.value == value) put(key, choice.word);
  }
  // The kinds have the same scale as the smallest tolerance.
  void tolerance(std::string_view key, double smallest, const std::optional<KindTolerances>& given,
                 const FieldInfo& info) {
    if (!given) return put(key, smallest);
    KindTolerances kinds = *given;
    const double scale = smallest / kinds.smallest();
    for (std::optional<double>* const kind : {&kinds.position, &kinds.angle, &kinds.velocity, &kinds.rate})
      if (*kind) **kind *= scale;
    for (auto& [body, value] : kinds.bodies) value *= scale;
    object(key, std::as_const(kinds), info);
  }
  void values_of(std::string_view key, const std::vector<std::pair<std::string, double>>& values, ElementKind,
                 const Range&, const FieldInfo&) {
    for (const auto& [name, value] : values) json[std::string(key)][name] = value;
  }
  void object(std::string_view key, const auto& settings, const FieldInfo&) {
    SettingsWriter inside;
    describe(inside, settings);
    if (!inside.json.empty()) put(key, inside.json);
  }
  void misplaced(std::string_view, std::string_view) {}

 private:
  void put(std::string_view key, const auto& value) { json[std::string(key)] = value; }
};

Json integrator_json(const IntegratorSettings& s) {
  SettingsWriter writer;
  describe(writer, s);
  if (s.step) {
    writer.json.erase("rtol");
    writer.json.erase("atol");
  }
  if (s.max_steps == IntegratorSettings{}.max_steps) writer.json.erase("max_steps");
  return writer.json;
}

Json formulation_json(const FormulationSettings& f) {
  SettingsWriter writer;
  describe(writer, f);
  if (f.type == FormulationType::penalty) {
    writer.json.erase("iterations");
    writer.json.erase("tolerance");
  }
  return writer.json;
}

}  // namespace

std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values, const std::vector<Body>& poses,
                                   const std::map<std::string, int>& modes) {
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
  // File names are relative to the folder of the text, which may have been removed.
  const auto folder = std::filesystem::weakly_canonical(std::filesystem::absolute(run.folder.path()));
  for (const NamedFiles& named : named_files(problem)) {
    Json moved = Json::array();
    for (const std::string& file : named.files)
      moved.push_back(std::filesystem::relative(file, folder).generic_string());
    text = with_value(text, named.path, json_text(named.is_list ? moved : moved[0]));
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string body = child_path("bodies", i);
    text = with_value(text, body + ".position", json_text(json_of(poses[i].position)));
    text = with_value(text, body + ".orientation", json_text(json_of(poses[i].orientation)));
  }
  for (const auto& [objective, number] : modes)
    text = with_value(text, fmt::format("objectives.{}.eigenvalue.mode", objective), std::to_string(number));
  return text;
}

std::string recommended_problem_text(const Run& run, const SimulationSettings& settings) {
  std::string text = optimized_problem_text(run, {});
  text = without_member(text, "simulation.accuracy");  // it was a choice, too
  text = with_value(text, "simulation.integrator", text_of(integrator_json(settings.integrator)));
  const Json formulation = formulation_json(settings.formulation);
  if (formulation != formulation_json(run.problem.scene.simulation.formulation))
    text = with_value(text, "simulation.formulation", text_of(formulation));
  return text;
}

}  // namespace mbsopt::inline app
