#include "app/optimized_problem.hpp"

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "app/json/findings.hpp"
#include "app/json/overrides.hpp"
#include "app/json/parse_json.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return nullptr;
    case Node::Kind::boolean:
      return node.boolean;
    case Node::Kind::number: {
      const bool whole = node.number == std::floor(node.number) && std::abs(node.number) < 1e15;
      return whole ? Json(static_cast<std::int64_t>(node.number)) : Json(node.number);
    }
    case Node::Kind::string:
      return node.string;
    case Node::Kind::array: {
      Json array = Json::array();
      for (const Node& item : node.items) array.push_back(to_json(item));
      return array;
    }
    case Node::Kind::object:
      break;
  }
  Json object = Json::object();
  for (std::size_t i = 0; i < node.items.size(); ++i) object[node.keys[i]] = to_json(node.items[i]);
  return object;
}

}  // namespace

std::string optimized_problem_text(const std::string& problem_file, const std::vector<std::string>& sets,
                                   const Problem& problem, const std::vector<std::pair<std::string, double>>& values,
                                   const std::filesystem::path& folder) {
  Findings findings(problem_file, read_text_file(problem_file));
  Node root = parse_json(findings);
  for (std::size_t i = 0; i < sets.size(); ++i) apply_override(root, sets[i], static_cast<int>(i) + 1, findings);
  findings.throw_if_any();
  Json json = to_json(root);
  for (const auto& [name, value] : values) {
    Json& parameter = json.at("parameters").at(name);
    (parameter.is_object() ? parameter["value"] : parameter) = value;
  }
  if (problem.identification) {
    for (std::size_t i = 0; i < problem.identification->experiments.size(); ++i) {
      const std::filesystem::path data = problem.identification->experiments[i].data;
      json["identification"]["experiments"][i]["data"] =
          std::filesystem::relative(data, std::filesystem::canonical(folder)).generic_string();
    }
  }
  return json.dump(2) + "\n";
}

}  // namespace mbsopt
