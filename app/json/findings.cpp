#include "app/json/findings.hpp"

#include <algorithm>
#include <limits>

namespace mbsopt {

void Findings::add(const Node& node, const std::string& path, const std::string& message) {
  if (node.source == 0)
    add_at(node.begin, path, message);
  else
    add_override(path, message);
}

void Findings::add_inside(const Node& node, std::size_t at, const std::string& path, const std::string& message) {
  if (node.source == 0)
    add_at(text_.inside_string(node.begin, at), path, message);
  else
    add_override(path, message + " (at character " + std::to_string(at + 1) + ")");
}

void Findings::add_at(std::size_t offset, const std::string& path, const std::string& message) {
  const Position position = text_.position(offset);
  found_.push_back({offset, {file_, position.line, position.column, path, message}});
}

void Findings::add_override(const std::string& path, const std::string& message) {
  found_.push_back({std::numeric_limits<std::size_t>::max(), {"", 0, 0, path, message}});
}

bool Findings::concerns(std::string_view path) const {
  const auto within = [](std::string_view inner, std::string_view outer) {
    return inner.starts_with(outer) &&
           (inner.size() == outer.size() || outer.empty() || inner[outer.size()] == '.' || inner[outer.size()] == '[');
  };
  const auto related = [&](std::string_view other) { return within(path, other) || within(other, path); };
  return std::any_of(found_.begin(), found_.end(), [&](const Found& found) { return related(found.finding.path); }) ||
         std::any_of(elsewhere_.begin(), elsewhere_.end(), related);
}

Finding Findings::finding(const Node& node, const std::string& path, const std::string& message) const {
  if (node.source != 0) return {"", 0, 0, path, message};
  const Position position = text_.position(node.begin);
  return {file_, position.line, position.column, path, message};
}

void Findings::throw_if_any() const {
  if (found_.empty()) return;
  std::vector<Found> sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Found& a, const Found& b) { return a.offset < b.offset; });
  std::vector<Finding> all;
  for (Found& found : sorted)
    if (std::find(all.begin(), all.end(), found.finding) == all.end()) all.push_back(std::move(found.finding));
  throw InputError(std::move(all));
}

}  // namespace mbsopt
