#include "app/optimized_problem.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "app/json/edit_text.hpp"
#include "app/json/source_text.hpp"
#include "app/run.hpp"
#include "core/scene/scene_path.hpp"

namespace mbsopt {
namespace {

std::string experiment_path(std::size_t index) { return child_path("identification.experiments", index); }

// The values that parameters take in one experiment: its overrides.
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

std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values) {
  const CommandOptions& options = run.context.options;
  return optimized_problem_text(options.problem_file, options.sets, run.problem, values, run.folder.path());
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
  if (!problem.identification) return text;
  text = with_experiment_values(std::move(text), problem, values);
  for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
    const std::filesystem::path data = problem.identification->experiments[i].data;
    const std::string relative = std::filesystem::relative(data, std::filesystem::canonical(folder)).generic_string();
    text = with_value(text, experiment_path(i) + ".data", nlohmann::json(relative).dump());
  }
  return text;
}

}  // namespace mbsopt
