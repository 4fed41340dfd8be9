#include "core/scene/scene_path.hpp"

#include "core/scene/type_table.hpp"

namespace mbsopt {

std::string child_path(const std::string& parent, std::string_view key) {
  if (!is_identifier(key) && key != "$schema") {
    std::string quoted;
    for (const char c : key) {
      if (c == '"' || c == '\\') quoted += '\\';
      quoted += c;
    }
    return parent + "[\"" + quoted + "\"]";
  }
  return parent.empty() ? std::string(key) : parent + "." + std::string(key);
}

std::string child_path(const std::string& parent, std::size_t index) {
  return parent + "[" + std::to_string(index) + "]";
}

}  // namespace mbsopt
