#include "app/json/overrides.hpp"

#include <stdexcept>

#include "app/json/parse_json.hpp"
#include "core/expression/counted.hpp"

namespace mbsopt::inline app {

namespace {

// Returns the member of an object, and creates it if it is missing.
Node& member(Node& object, const std::string& key, int number) {
  for (std::size_t i = 0; i < object.keys.size(); ++i)
    if (object.keys[i] == key) return object.items[i];
  object.keys.push_back(key);
  object.key_offsets.push_back(0);
  Node& made = object.items.emplace_back();
  made.kind = Node::Kind::object;
  made.source = number;
  return made;
}

// "k1": 100 is short for "k1": {"value": 100}; parameters.k1.value sets both.
void spell_out_parameter(Node& parameter) {
  Node object;
  object.kind = Node::Kind::object;
  object.begin = parameter.begin;
  object.end = parameter.end;
  object.source = parameter.source;
  object.keys.push_back("value");
  object.key_offsets.push_back(parameter.begin);
  object.items.push_back(std::move(parameter));
  parameter = std::move(object);
}

}  // namespace

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
  *node = parse_override_value(override_text.substr(equals + 1), number);
}

}  // namespace mbsopt::inline app
