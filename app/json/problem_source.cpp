#include "app/json/problem_source.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "app/json/overrides.hpp"
#include "app/json/parse_json.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt::inline app {
namespace {

// "drives[0].law" of "drives[0].law: its samples"; empty if there is no path.
std::string path_before(const std::string& words) {
  const std::size_t end = words.find(": ");
  if (end == std::string::npos) return {};
  const auto belongs = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("_.[]").find(c) != std::string_view::npos;
  };
  return std::all_of(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(end), belongs) ? words.substr(0, end)
                                                                                               : std::string();
}

}  // namespace

std::optional<Finding> ProblemSource::finding(const std::string& words) const {
  const std::string path = path_before(words);
  if (path.empty()) return std::nullopt;
  try {
    if (&nearest(root, path) == &root) return std::nullopt;
    return finding(path, words.substr(path.size() + 2));
  } catch (const std::invalid_argument&) {  // no path: the words alone will do
    return std::nullopt;
  }
}

std::optional<std::string> ProblemSource::placed(const std::string& words) const {
  const std::optional<Finding> found = finding(words);
  return found ? std::optional(to_string(*found)) : std::nullopt;
}

ProblemSource problem_source_of(const std::string& text, const std::filesystem::path& name,
                                const std::vector<std::string>& set_overrides) {
  Findings findings(name.string(), text);
  Node root = parse_json(findings);
  for (std::size_t i = 0; i < set_overrides.size(); ++i)
    apply_override(root, set_overrides[i], static_cast<int>(i) + 1, findings);
  return {name, std::move(findings), std::move(root)};
}

std::shared_ptr<ProblemSource> read_problem_source(const std::filesystem::path& file,
                                                   const std::vector<std::string>& set_overrides) {
  return std::make_shared<ProblemSource>(problem_source_of(read_text_file(file), file, set_overrides));
}

}  // namespace mbsopt::inline app
