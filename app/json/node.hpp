// A JSON value with its place in the text.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene_path.hpp"

namespace mbsopt::inline app {

// A JSON path (core/scene/scene_path.hpp), step by step.
struct PathStep {
  std::string key;  // of an object
  bool is_index = false;
  std::size_t index = 0;
};

struct Node {
  enum class Kind { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  bool boolean = false;
  double number = 0;
  std::string string = {};         // of a string: its value, escapes resolved
  std::vector<Node> items = {};    // of an array; of an object: the values of its keys
  std::string key = {};            // in the object around it
  std::size_t key_begin = 0;       // its first byte in the text
  std::size_t begin = 0, end = 0;  // its own first byte, and one after its last
  int source = 0;                  // 0: the problem file, k: the k-th --set

  const Node* find(std::string_view wanted) const;  // by its key, of an object; nullptr when there is none
  const Node* at(const PathStep& step) const;       // of an object or a list; nullptr when there is none
};

// "an object", "a list of 2", "the number 3", "the string 'x'", ...
std::string what_is(const Node& node);

// Throws std::invalid_argument if the text is not a path.
std::vector<PathStep> parse_path(std::string_view path);

// The value at a path, or the nearest one around it that exists.
const Node& nearest(const Node& root, std::string_view path);

}  // namespace mbsopt::inline app
