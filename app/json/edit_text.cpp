#include "app/json/edit_text.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "app/json/findings.hpp"
#include "app/json/parse_json.hpp"

namespace mbsopt::inline app {

namespace {

std::string json_string(const std::string& key) {
  return nlohmann::json(key).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string replaced(const std::string& text, std::size_t begin, std::size_t end, const std::string& by) {
  return text.substr(0, begin) + by + text.substr(end);
}

}  // namespace

std::string with_value(const std::string& text, std::string_view path, const std::string& json) {
  Findings findings("problem file", text);
  const Node root = parse_json(findings);
  std::vector<PathStep> steps;
  try {
    steps = parse_path(path);
  } catch (const std::invalid_argument& error) {
    findings.add_override(std::string(path), std::string("is not a path: ") + error.what());
  }
  findings.throw_if_any();

  const Node* node = &root;
  std::size_t depth = 0;
  for (; depth < steps.size(); ++depth) {
    const Node* const next = node->at(steps[depth]);
    if (!next) break;
    node = next;
  }
  if (depth == steps.size()) return replaced(text, node->begin, node->end, json);

  // "k1": 100 is short for "k1": {"value": 100}
  const bool is_short = depth == 2 && steps[0].key == "parameters" && node->kind != Node::Kind::object;
  if (is_short && steps[depth].key == "value" && steps.size() == 3) return replaced(text, node->begin, node->end, json);

  std::string member = json;
  for (std::size_t i = steps.size(); i-- > depth;) {
    const bool impossible = steps[i].is_index || (node->kind != Node::Kind::object && !is_short);
    if (impossible) {
      findings.add_override(std::string(path), "leads nowhere: there is " + what_is(*node) + " on the way");
      findings.throw_if_any();
    }
    member = json_string(steps[i].key) + ": " + member;
    if (i > depth) member = "{" + member + "}";
  }
  if (is_short) {
    const std::string value = text.substr(node->begin, node->end - node->begin);
    return replaced(text, node->begin, node->end, "{\"value\": " + value + ", " + member + "}");
  }
  if (!node->items.empty()) member += ", ";
  return replaced(text, node->begin + 1, node->begin + 1, member);
}

std::string without_member(const std::string& text, std::string_view path) {
  Findings findings("problem file", text);
  const Node root = parse_json(findings);
  findings.throw_if_any();
  const Node *parent = nullptr, *node = &root;
  for (const PathStep& step : parse_path(path)) {
    parent = node;
    node = parent->find(step.key);
    if (!node) return text;
  }
  if (!parent) return text;
  if (node != &parent->items.back()) return replaced(text, node->key_begin, (node + 1)->key_begin, "");
  return replaced(text, node != &parent->items.front() ? (node - 1)->end : node->key_begin, node->end, "");
}

std::string with_override(const std::string& text, const std::string& override_text) {
  const std::size_t equals = override_text.find('=');
  const std::string value = equals == std::string::npos ? "" : override_text.substr(equals + 1);
  const bool is_json = nlohmann::json::accept(value, true);
  return with_value(text, override_text.substr(0, equals), is_json ? value : json_string(value));
}

std::string with_parameter_values(const std::string& text, const std::map<std::string, double>& values) {
  std::string result = text;
  for (const auto& [name, value] : values)
    result = with_value(result, "parameters." + name + ".value", fmt::format("{:.17g}", value));
  return result;
}

}  // namespace mbsopt::inline app
