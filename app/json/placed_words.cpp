#include "app/json/placed_words.hpp"

#include <algorithm>
#include <cctype>
#include <exception>

#include "app/json/findings.hpp"
#include "app/json/overrides.hpp"
#include "app/json/parse_json.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt {
namespace {

// "drives[0].law" of "drives[0].law: its samples"; empty where there is none.
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

std::optional<std::string> placed(const std::string& words, const std::filesystem::path& file,
                                  const std::vector<std::string>& sets) {
  const std::string path = path_before(words);
  std::error_code error;
  if (path.empty() || !std::filesystem::is_regular_file(file, error)) return std::nullopt;
  try {
    Findings findings(file.string(), read_text_file(file));
    Node root = parse_json(findings);
    for (std::size_t i = 0; i < sets.size(); ++i) apply_override(root, sets[i], static_cast<int>(i) + 1, findings);
    const Node& node = nearest(root, path);
    if (&node == &root) return std::nullopt;
    return to_string(findings.finding(node, path, words.substr(path.size() + 2)));
  } catch (const std::exception&) {  // the words alone will do
    return std::nullopt;
  }
}

}  // namespace mbsopt
