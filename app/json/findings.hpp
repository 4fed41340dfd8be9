// Collects the faults of a problem during reading: in the file, or in the changes of --set.
#pragma once

#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "app/json/input_error.hpp"
#include "app/json/node.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt::inline app {

class Findings {
 public:
  Findings(std::string file, std::string content) : file_(std::move(file)), text_(std::move(content)) {}

  const SourceText& text() const { return text_; }

  // Adds a finding about a value, or about byte `at` of its string.
  void add(const Node& node, const std::string& path, const std::string& message);
  void add_inside(const Node& node, std::size_t at, const std::string& path, const std::string& message);
  // Adds a finding about an offset of the file.
  void add_at(std::size_t offset, const std::string& path, const std::string& message);
  void add_override(const std::string& path, const std::string& message);

  // Marks a path whose finding is reported at another place.
  void add_elsewhere(const std::string& path) { mark(path); }

  // Returns whether a path, one around it, or one inside it has a finding already.
  bool concerns(std::string_view path) const;
  bool any() const { return !found_.empty(); }
  // Makes a finding about a value without collecting it, for warnings.
  Finding finding(const Node& node, const std::string& path, const std::string& message) const;
  void throw_if_any() const;  // InputError, in the order of the file, each once

 private:
  struct Found {
    std::size_t offset;
    Finding finding;
  };
  Finding at(std::size_t offset, const std::string& path, const std::string& message) const;
  void mark(std::string_view path);

  std::string file_;
  SourceText text_;
  std::vector<Found> found_;
  std::unordered_set<std::string> marked_, around_;  // paths with findings, and these with all paths they lie in
};

// A value that is being read, with its place in the file. It builds its JSON path only for a finding. It refers to the
// value around it, which must live longer. An absent value converts to false.
class PlacedNode {
 public:
  PlacedNode() = default;
  PlacedNode(const Node& root, Findings& findings) : node_(&root), findings_(&findings) {}
  explicit operator bool() const { return node_ != nullptr; }
  const Node& operator*() const { return *node_; }
  const Node* operator->() const { return node_; }

  PlacedNode find(std::string_view key) const;  // of an object
  // The values in an object or a list. An absent value has none.
  std::vector<PlacedNode> items() const;
  const std::string& key() const { return node_->key; }  // its key in the object around it
  std::string path() const;
  Findings& findings() const { return *findings_; }

  // Add a finding about the value, about its key, or about byte `at` of its string.
  void refuse(const std::string& message) const { findings_->add(*node_, path(), message); }
  void must_be(const std::string& what) const { refuse("must be " + what + ", found " + what_is(*node_)); }
  void refuse_key(const std::string& message) const;
  void refuse_inside(std::size_t at, const std::string& message) const {
    findings_->add_inside(*node_, at, path(), message);
  }

 private:
  PlacedNode(const PlacedNode& around, std::size_t index)
      : node_(&around.node_->items[index]), findings_(around.findings_), around_(&around), index_(index) {}

  const Node* node_ = nullptr;
  Findings* findings_ = nullptr;
  const PlacedNode* around_ = nullptr;  // nullptr: it is the root
  std::size_t index_ = 0;               // in what is around it
};

}  // namespace mbsopt::inline app
