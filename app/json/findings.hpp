// Collects what is wrong with a problem while it is read: in the file, or in what --set changed of it.
#pragma once

#include <string>
#include <string_view>
#include <unordered_set>
#include <vector>

#include "app/json/input_error.hpp"
#include "app/json/node.hpp"
#include "app/json/source_text.hpp"

namespace mbsopt {

class Findings {
 public:
  Findings(std::string file, std::string content) : file_(std::move(file)), text_(std::move(content)) {}

  const SourceText& text() const { return text_; }

  // About a value, or about byte `at` of the string it holds.
  void add(const Node& node, const std::string& path, const std::string& message);
  void add_inside(const Node& node, std::size_t at, const std::string& path, const std::string& message);
  // About an offset of the file.
  void add_at(std::size_t offset, const std::string& path, const std::string& message);
  void add_override(const std::string& path, const std::string& message);

  // The path counts as having a finding, which is told at another place.
  void add_elsewhere(const std::string& path) { mark(path); }

  // Whether a path, one it lies in, or one that lies in it has a finding already.
  bool concerns(std::string_view path) const;
  bool any() const { return !found_.empty(); }
  // A finding about a value, not collected: for what is no error.
  Finding finding(const Node& node, const std::string& path, const std::string& message) const;
  void throw_if_any() const;  // InputError, in the order of the file, each once

 private:
  struct Found {
    std::size_t offset;
    Finding finding;
  };
  void mark(std::string_view path);

  std::string file_;
  SourceText text_;
  std::vector<Found> found_;
  std::unordered_set<std::string> marked_, around_;  // paths with findings, and these with all paths they lie in
};

}  // namespace mbsopt
