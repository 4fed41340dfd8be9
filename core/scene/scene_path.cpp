#include "core/scene/scene_path.hpp"

#include "core/scene/type_table.hpp"

namespace mbsopt {

std::string child_path(const std::string& parent, std::string_view key) {
  const std::string name(key);
  if (!is_identifier(key) && key != "$schema") return parent + "[\"" + name + "\"]";
  return parent.empty() ? name : parent + "." + name;
}

std::string child_path(const std::string& parent, std::size_t index) {
  return parent + "[" + std::to_string(index) + "]";
}

}  // namespace mbsopt
