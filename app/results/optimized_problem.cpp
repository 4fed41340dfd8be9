#include "app/results/optimized_problem.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>

#include "app/json/edit_text.hpp"
#include "app/json/source_text.hpp"
#include "app/run/run.hpp"
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
  // Files are named relative to the folder that the text will be in.
  const auto moved = [&](const std::string& path, const std::string& file) {
    const std::string relative = std::filesystem::relative(file, std::filesystem::canonical(folder)).generic_string();
    text = with_value(text, path, nlohmann::json(relative).dump());
  };
  const std::vector<Drive>& drives = problem.scene.drives;
  for (std::size_t i = 0; i < drives.size(); ++i)
    if (drives[i].samples) moved(child_path("drives", i) + ".law.csv", drives[i].samples->csv);
  const auto laws_moved = [&](const std::vector<DriveLaw>& laws, const std::string& owner) {
    for (std::size_t k = 0; k < laws.size(); ++k)
      if (laws[k].samples) moved(child_path(owner + ".drives", k) + ".law.csv", laws[k].samples->csv);
  };
  for (std::size_t c = 0; c < problem.cases.size(); ++c) laws_moved(problem.cases[c].drives, child_path("cases", c));
  if (!problem.identification) return text;
  text = with_experiment_values(std::move(text), problem, values);
  for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
    const ExperimentSpec& experiment = problem.identification->experiments[i];
    moved(experiment_path(i) + ".data", experiment.data);
    laws_moved(experiment.drives, experiment_path(i));
  }
  return text;
}

}  // namespace mbsopt
