#include "app/json/findings.hpp"

#include <algorithm>
#include <limits>
#include <set>

namespace mbsopt::inline app {
namespace {

// Tries the path and all paths around it, from within, until `is_it` returns true. Returns whether it did.
template <class Is>
bool for_each_outer(std::string_view path, Is&& is_it) {
  for (;;) {
    if (is_it(path)) return true;
    if (path.empty()) return false;
    const std::size_t end = path.find_last_of(".[");
    path = path.substr(0, end == std::string_view::npos ? 0 : end);
  }
}

}  // namespace

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
  found_.push_back({offset, at(offset, path, message)});
  mark(path);
}

void Findings::add_override(const std::string& path, const std::string& message) {
  found_.push_back({std::numeric_limits<std::size_t>::max(), {"", 0, 0, path, message}});
  mark(path);
}

Finding Findings::at(std::size_t offset, const std::string& path, const std::string& message) const {
  const auto [line, column] = text_.position(offset);
  return {file_, line, column, path, message};
}

void Findings::mark(std::string_view path) {
  if (!marked_.emplace(path).second) return;
  for_each_outer(path, [&](std::string_view outer) { return around_.emplace(outer), false; });
}

bool Findings::concerns(std::string_view path) const {
  if (around_.contains(std::string(path))) return true;
  return for_each_outer(path, [&](std::string_view outer) { return marked_.contains(std::string(outer)); });
}

Finding Findings::finding(const Node& node, const std::string& path, const std::string& message) const {
  return node.source == 0 ? at(node.begin, path, message) : Finding{"", 0, 0, path, message};
}

void Findings::throw_if_any() const {
  if (found_.empty()) return;
  std::vector<Found> sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Found& a, const Found& b) { return a.offset < b.offset; });
  std::vector<Finding> all;
  std::set<std::string> known;
  for (Found& found : sorted)
    if (known.insert(to_string(found.finding)).second) all.push_back(std::move(found.finding));
  throw InputError(std::move(all));
}

PlacedNode PlacedNode::find(std::string_view key) const {
  const Node* const found = node_->find(key);
  return found ? PlacedNode(*this, static_cast<std::size_t>(found - node_->items.data())) : PlacedNode();
}

std::vector<PlacedNode> PlacedNode::items() const {
  std::vector<PlacedNode> list;
  for (std::size_t i = 0; node_ && i < node_->items.size(); ++i) list.push_back(PlacedNode(*this, i));
  return list;
}

void PlacedNode::refuse_key(const std::string& message) const {
  if (around_->node_->source == 0 && node_->source == 0)
    findings_->add_at(node_->key_begin, path(), message);
  else
    findings_->add_override(path(), message);
}

std::string PlacedNode::path() const {
  if (!around_) return "";
  const bool in_object = around_->node_->kind == Node::Kind::object;
  return in_object ? child_path(around_->path(), key()) : child_path(around_->path(), index_);
}

}  // namespace mbsopt::inline app
