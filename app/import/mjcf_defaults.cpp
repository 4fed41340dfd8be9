#include "app/import/mjcf_defaults.hpp"

#include <fmt/format.h>

namespace mbsopt {

MjcfDefaults::MjcfDefaults(const XmlElement& mujoco, ModelErrors& errors) : errors_(errors) {
  bool outermost = true;
  for (const XmlElement* node : mujoco.children("default")) {
    if (outermost) outermost_ = node->text("class").value_or(outermost_);
    add(*node, "", true);
    outermost = false;
  }
}

void MjcfDefaults::add(const XmlElement& node, const std::string& around, bool outermost) {
  const std::optional<std::string> given = node.text("class");
  if (!given && !outermost) return errors_.add(node, "has no attribute 'class'");
  const std::string name = given.value_or(outermost_);
  if (!around.empty()) around_[name] = around;
  for (const XmlElement* child : node.children()) {
    if (child->name != "default") found_[name][child->name].push_back(child);
  }
  for (const XmlElement* child : node.children("default")) add(*child, name, false);
}

std::vector<const XmlElement*> MjcfDefaults::sources(const XmlElement& element, const std::string& childclass) {
  std::vector<const XmlElement*> list{&element};
  std::string name = element.text("class").value_or(childclass);
  if (name.empty()) name = outermost_;
  if (name != outermost_ && !around_.contains(name)) {
    errors_.add(element, fmt::format("there is no default class '{}'", name));
    return list;
  }
  for (;;) {
    for (const XmlElement* node : found_[name][element.name]) {
      node->mark_read();
      list.push_back(node);
    }
    const auto next = around_.find(name);
    if (next == around_.end()) return list;
    name = next->second;
  }
}

std::optional<std::string> MjcfDefaults::text(const XmlElement& element, const std::string& childclass,
                                              std::string_view attribute) {
  std::optional<std::string> value;
  for (const XmlElement* source : sources(element, childclass)) {
    const std::optional<std::string> own = source->text(attribute);
    if (!value) value = own;
  }
  return value;
}

}  // namespace mbsopt
