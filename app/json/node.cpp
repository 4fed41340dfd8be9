#include "app/json/node.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "core/expression/expression.hpp"

namespace mbsopt::inline app {

const Node* Node::find(std::string_view wanted) const {
  const auto found = kind == Kind::object ? std::ranges::find(items, wanted, &Node::key) : items.end();
  return found == items.end() ? nullptr : &*found;
}

const Node* Node::at(const PathStep& step) const {
  if (!step.is_index) return find(step.key);
  return kind == Kind::array && step.index < items.size() ? &items[step.index] : nullptr;
}

std::string what_is(const Node& node) {
  constexpr std::size_t kShown = 40;
  switch (node.kind) {
    case Node::Kind::null:
      return "null";
    case Node::Kind::boolean:
      return node.boolean ? "true" : "false";
    case Node::Kind::number:
      return "the number " + Expression(node.number).text();
    case Node::Kind::string:
      return node.string.size() > kShown ? "the string '" + node.string.substr(0, kShown) + "...'"
                                         : "the string '" + node.string + "'";
    case Node::Kind::array:
      return "a list of " + std::to_string(node.items.size());
    case Node::Kind::object:
      return "an object";
  }
  return "";
}

namespace {

// Reads the key in ["..."] at `at`, and moves `at` behind it.
std::string quoted_key(std::string_view path, std::size_t& at) {
  std::string key;
  for (at += 2; at < path.size() && path[at] != '"'; ++at) {
    if (path[at] == '\\' && at + 1 < path.size()) ++at;
    key += path[at];
  }
  if (path.substr(at, 2) != "\"]") throw std::invalid_argument("'[\"' is never closed");
  at += 2;
  return key;
}

}  // namespace

std::vector<PathStep> parse_path(std::string_view path) {
  std::vector<PathStep> steps;
  std::size_t at = 0;
  while (at < path.size()) {
    if (path.substr(at, 2) == "[\"") {
      steps.push_back({quoted_key(path, at), false, 0});
    } else if (path[at] == '[') {
      const std::size_t close = path.find(']', at);
      if (close == std::string_view::npos) throw std::invalid_argument("'[' is never closed");
      PathStep step;
      step.is_index = true;
      const char* const last = path.data() + close;
      const auto [end, error] = std::from_chars(path.data() + at + 1, last, step.index);
      if (error != std::errc() || end != last) throw std::invalid_argument("an index in [] must be a whole number");
      at = close + 1;
      steps.push_back(std::move(step));
    } else {
      if (path[at] == '.') ++at;
      const std::size_t end = std::min(path.find_first_of(".[", at), path.size());
      if (end == at) throw std::invalid_argument("a key is missing");
      steps.push_back({std::string(path.substr(at, end - at)), false, 0});
      at = end;
    }
  }
  if (steps.empty()) throw std::invalid_argument("is empty");
  return steps;
}

const Node& nearest(const Node& root, std::string_view path) {
  const Node* node = &root;
  if (path.empty()) return root;
  for (const PathStep& step : parse_path(path)) {
    const Node* const next = node->at(step);
    if (!next) break;
    node = next;
  }
  return *node;
}

}  // namespace mbsopt::inline app
