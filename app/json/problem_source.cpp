#include "app/json/problem_source.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <utility>

#include "app/json/parse_json.hpp"
#include "app/json/source_text.hpp"
#include "core/expression/counted.hpp"

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

// Returns the member of an object, and creates it if it is missing.
Node& member(Node& object, const std::string& key, int number) {
  const auto found = std::ranges::find(object.items, key, &Node::key);
  return found != object.items.end()
             ? *found
             : object.items.emplace_back(Node{.kind = Node::Kind::object, .key = key, .source = number});
}

// "k1": 100 is short for "k1": {"value": 100}; parameters.k1.value sets both.
void spell_out_parameter(Node& parameter) {
  Node value = parameter;
  value.key = "value";
  value.key_begin = value.begin;
  parameter.kind = Node::Kind::object;
  parameter.items = {std::move(value)};
}

// --set path=value: changes a value before it is read, and creates the objects on the way to it. override_text is
// "parameters.k1.value=120". number counts the --set options from 1.
void apply_override(Node& root, const std::string& override_text, int number, Findings& findings) {
  const std::size_t equals = override_text.find('=');
  const std::string path = override_text.substr(0, equals);
  if (equals == std::string::npos) {
    findings.add_override(path, "must be written path=value, such as parameters.k1.value=120");
    return;
  }
  std::vector<PathStep> steps;
  try {
    steps = parse_path(path);
  } catch (const std::invalid_argument& error) {
    findings.add_override(path, std::string("is not a path: ") + error.what() + "; an example: bodies[0].mass");
    return;
  }
  Node* node = &root;
  std::string here;
  for (std::size_t depth = 0; depth < steps.size(); ++depth) {
    const PathStep& step = steps[depth];
    if (!step.is_index && depth == 2 && steps[0].key == "parameters" && node->kind != Node::Kind::object)
      spell_out_parameter(*node);
    const Node::Kind wanted = step.is_index ? Node::Kind::array : Node::Kind::object;
    if (node->kind != wanted) {
      findings.add_override(path, (here.empty() ? "the file" : here) + " is " + what_is(*node) +
                                      (step.is_index ? ", not a list" : ", not an object"));
      return;
    }
    if (step.is_index && step.index >= node->items.size()) {
      findings.add_override(path,
                            here + " has " + counted(node->items.size(), "entry", "entries") + ", numbered from 0");
      return;
    }
    const bool list_next = depth + 1 < steps.size() && steps[depth + 1].is_index;
    if (!step.is_index && list_next && !node->find(step.key)) {
      const std::string list = child_path(here, step.key);
      findings.add_override(
          path, "there is no " + list + ", and an entry alone cannot be made; set the list whole: " + list + "=[...]");
      return;
    }
    here = step.is_index ? child_path(here, step.index) : child_path(here, step.key);
    node = step.is_index ? &node->items[step.index] : &member(*node, step.key, number);
  }
  Node value = parse_override_value(override_text.substr(equals + 1), number);
  value.key = node->key;
  value.key_begin = node->key_begin;
  *node = std::move(value);
}

}  // namespace

std::optional<std::string> ProblemSource::placed(const std::string& words) const {
  const std::string path = path_before(words);
  if (path.empty()) return std::nullopt;
  try {
    if (&nearest(root, path) == &root) return std::nullopt;
    return to_string(finding(path, words.substr(path.size() + 2)));
  } catch (const std::invalid_argument&) {  // no path: the words alone will do
    return std::nullopt;
  }
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
