#include "app/optimized_problem.hpp"

#include <map>
#include <nlohmann/json.hpp>

#include "app/json/edit_text.hpp"
#include "app/json/source_text.hpp"
#include "core/scene/scene_path.hpp"

namespace mbsopt {

std::string optimized_problem_text(const std::string& problem_file, const std::vector<std::string>& sets,
                                   const Problem& problem, const std::vector<std::pair<std::string, double>>& values,
                                   const std::filesystem::path& folder) {
  std::string text = read_text_file(problem_file);
  for (const std::string& set : sets) text = with_override(text, set);
  text = with_parameter_values(text, {values.begin(), values.end()});
  if (!problem.identification) return text;
  for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
    const std::filesystem::path data = problem.identification->experiments[i].data;
    const std::string relative = std::filesystem::relative(data, std::filesystem::canonical(folder)).generic_string();
    text = with_value(text, child_path("identification.experiments", i) + ".data", nlohmann::json(relative).dump());
  }
  return text;
}

}  // namespace mbsopt
