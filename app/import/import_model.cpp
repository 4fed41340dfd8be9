#include "app/import/import_model.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "app/import/imported_model.hpp"
#include "app/json/node.hpp"
#include "app/json/read_problem.hpp"
#include "core/start/model_warnings.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline app {
namespace {

// The element of the model that a path of the problem file begins with, or an empty place.
Finding place_of(const std::string& path, const ImportedModel& model) {
  const std::vector<PathStep> steps = path.empty() ? std::vector<PathStep>{} : parse_path(path);
  if (steps.size() < 2 || !steps[1].is_index) return {};
  const std::size_t i = steps[1].index;
  if (steps[0].key == "bodies" && i + 1 < model.bodies.size()) return model.bodies[i + 1].place;
  if (steps[0].key == "joints" && i < model.joints.size()) return model.joints[i].place;
  return {};
}

// Returns the problem. Findings about a body or a joint name their element of the model.
Problem checked(const std::string& text, const ImportedModel& model, const std::string& file) {
  try {
    return read_problem_text(text, file);
  } catch (const InputError& error) {
    std::vector<Finding> findings = error.findings();
    for (Finding& finding : findings) {
      const Finding place = place_of(finding.path, model);
      if (place.line > 0) finding.path = place.path + ": " + finding.path.substr(finding.path.find('.') + 1);
      finding.line = place.line;
      finding.column = place.column;
    }
    throw InputError(findings);
  }
}

// Bodies whose accelerations no simulation can compute. The model may still serve kinematics.
std::vector<std::string> warnings_of(const Problem& problem, const ImportedModel& model) {
  const Mechanism mechanism(problem.scene, parameter_values(problem.scene));
  const Assembly assembly(mechanism, problem.scene.simulation.start_time);
  std::vector<std::string> warnings;
  for (const int body : massless_bodies(mechanism, assembly)) {
    const ImportedBody& b = model.bodies[static_cast<std::size_t>(body)];
    warnings.push_back(
        fmt::format("line {}: '{}' has no mass or inertia in a direction that no joint holds, and "
                    "simulate fails; give it some",
                    b.place.line, b.name));
  }
  return warnings;
}

std::string comment(const std::vector<std::string>& lines, const char* heading) {
  if (lines.empty()) return "";
  return fmt::format("// {}\n//   {}\n", heading, fmt::join(lines, "\n//   "));
}

ImportedProblem imported_from(const std::string& text, const std::filesystem::path& path, const auto& warnings) {
  ModelFile file(text, path.string());
  const std::string format = file.root().name();
  if (format != "robot" && format != "mujoco")
    file.root().error("is not a model that import reads: URDF begins with <robot>, MJCF with <mujoco>");
  file.throw_if_any();
  ImportedModel model = format == "robot" ? urdf_model(file) : mjcf_model(file);
  const std::string json = problem_text(model);
  ImportedProblem imported{.name = model.name,
                           .changed = model.changed,
                           .warnings = warnings(checked(json, model, file.name), model),
                           .dropped = file.dropped(),
                           .bodies = model.bodies.size() - 1,
                           .joints = model.joints.size() + model.ties.size()};
  for (std::vector<std::string>* list : {&imported.changed, &imported.dropped, &imported.warnings}) {
    for (std::string& words : *list)
      std::ranges::replace_if(
          words, [](unsigned char c) { return c < ' '; }, ' ');
  }
  imported.text = fmt::format("// Imported from {}.\n", path.filename().string()) +
                  comment(imported.warnings, "Warnings:") + comment(imported.changed, "Changed:") +
                  comment(imported.dropped, "Dropped (kinds of elements and attributes, with their first line):") +
                  json;
  return imported;
}

}  // namespace

ImportedProblem import_model(const std::filesystem::path& model) {
  return imported_from(read_text_file(model), model, warnings_of);
}

ImportedProblem read_model_text(const std::string& text, const std::filesystem::path& model) {
  return imported_from(text, model, [](const Problem&, const ImportedModel&) { return std::vector<std::string>{}; });
}

}  // namespace mbsopt::inline app
