#include "app/import/model_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <sstream>

namespace mbsopt::inline app {
namespace {

std::size_t offset(const pugi::xml_node& node) { return static_cast<std::size_t>(node.offset_debug() - 1); }  // its "<"

[[noreturn]] void refuse_file(const ModelFile& file, std::size_t at, const std::string& message) {
  const auto [line, column] = file.source.position(at);
  throw InputError({Finding{file.name, line, column, "", message}});
}

void check(const ModelFile& file, const pugi::xml_node& node, int depth) {
  constexpr int kDeepest = 1000;  // each level takes some of the stack; no mechanism has so many bodies in a row
  if (depth > kDeepest) refuse_file(file, offset(node), fmt::format("elements are nested more than {} deep", kDeepest));
  for (const pugi::xml_attribute& a : node.attributes()) {
    if (node.attribute(a.name()) != a)
      refuse_file(file, offset(node), fmt::format("<{}> has the attribute '{}' twice", node.name(), a.name()));
  }
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() == pugi::node_element) check(file, child, depth + 1);
  }
}

// The first row of "joint pos" or "* pos".
const ModelAttribute& row_of(const ModelFile& file, const std::string& element, const std::string& attribute) {
  const std::string exactly = element + " " + attribute, of_any = "* " + attribute;
  const auto row =
      std::ranges::find_if(file.table, [&](const ModelAttribute& a) { return a.what == exactly || a.what == of_any; });
  assert(row != file.table.end());
  return *row;
}

// Returns the fault in words, or "".
std::string read_numbers(const std::string& text, int kind, std::vector<double>& values) {
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);  // from_chars takes no "+"
    const auto [end, failure] = std::from_chars(begin, word.data() + word.size(), values.emplace_back());
    if (failure != std::errc() || end != word.data() + word.size() || !std::isfinite(values.back()))
      return fmt::format("'{}' is not a number{}", word,
                         text.find("${") == std::string::npos ? "" : "; run xacro on the file first");
  }
  const int wanted = kind % kNonzero, count = static_cast<int>(values.size());
  if (count == 0) return "is empty, must hold numbers";
  if (wanted != kList && count != wanted) return fmt::format("has {} numbers, must have {}", count, wanted);
  const bool zero = std::ranges::all_of(values, [](double value) { return value == 0; });
  return kind > kNonzero && zero ? "is zero" : "";
}

void add_dropped(const ModelFile& file, const pugi::xml_node& node, std::vector<std::string>& kinds,
                 std::vector<std::string>& list) {
  const auto add = [&](const pugi::xml_node& at, const std::string& what) {
    if (std::ranges::find(kinds, what) != kinds.end()) return;
    const auto acts = [&](const ModelAttribute& a) { return a.kind == kActs && a.what == what; };
    kinds.push_back(what);
    list.push_back(fmt::format("line {}: {}{}", file.source.position(offset(at)).line, what,
                               std::ranges::any_of(file.table, acts) ? " (may change the motion)" : ""));
  };
  for (const pugi::xml_attribute& a : node.attributes()) {
    if (!file.read.contains(a.internal_object())) add(node, fmt::format("{} {}", node.name(), a.name()));
  }
  for (const pugi::xml_node& child : node.children()) {
    if (child.type() != pugi::node_element) continue;
    if (file.read.contains(child.internal_object()))
      add_dropped(file, child, kinds, list);
    else
      add(child, child.name());
  }
}

}  // namespace

std::optional<std::string> ModelElement::given(const std::string& attribute) const {
  const pugi::xml_attribute found = node_.attribute(attribute.c_str());
  if (!found) return std::nullopt;
  file_->read.insert(found.internal_object());
  if (const auto origins = file_->origins.find(found.internal_object()); origins != file_->origins.end())
    file_->read.insert(origins->second.begin(), origins->second.end());
  return found.value();
}

std::string ModelElement::word(const std::string& attribute) const {
  const ModelAttribute& row = row_of(*file_, name(), attribute);
  const std::string word = given(attribute).value_or(row.otherwise.value_or(""));
  if (word.empty() && !row.otherwise) error(fmt::format("has no attribute '{}'", attribute));
  if (row.words.empty() || std::ranges::find(row.words, word) != row.words.end()) return word;
  error(fmt::format("{}: is '{}', must be {}", attribute, word, fmt::join(row.words, " or ")));
  return row.words.front();
}

Eigen::VectorXd ModelElement::numbers(const std::string& attribute) const {
  const ModelAttribute& row = row_of(*file_, name(), attribute);
  const std::string given = word(attribute);
  std::vector<double> values;
  const std::string fault = given.empty() && !row.otherwise ? "" : read_numbers(given, row.kind, values);
  if (!fault.empty()) error(fmt::format("{}: {}", attribute, fault));
  if (!fault.empty() || values.empty()) return Eigen::VectorXd::Zero(std::max(row.kind % kNonzero, 0));
  return Eigen::VectorXd::Map(values.data(), static_cast<Eigen::Index>(values.size()));
}

ModelElement ModelElement::child(const char* name) const {
  const ModelElement found{*file_, node_.child(name)};
  if (found) found.mark_read();
  return found;
}

std::vector<ModelElement> ModelElement::children(const std::string& name) const {
  std::vector<ModelElement> found;
  for (const pugi::xml_node& node : node_.children()) {
    if (node.type() != pugi::node_element || (!name.empty() && node.name() != name)) continue;
    found.emplace_back(*file_, node);
    if (!name.empty()) found.back().mark_read();
  }
  return found;
}

void ModelElement::mark_read(bool read) const {
  if (read)
    file_->read.insert(node_.internal_object());
  else
    file_->read.erase(node_.internal_object());
}

void ModelElement::inherit(const ModelElement& from, const std::vector<std::string>& alternatives) const {
  from.mark_read();
  const auto is_alternative = [&](const pugi::xml_attribute& a) {
    return std::ranges::find(alternatives, a.name()) != alternatives.end();
  };
  for (const pugi::xml_attribute& offered : from.node_.attributes()) {
    const std::string name = offered.name();
    if (name == "name" || name.ends_with("class")) continue;
    pugi::xml_attribute own = node_.find_attribute([&](const pugi::xml_attribute& a) {
      return a.name() == name || (is_alternative(a) && is_alternative(offered));
    });
    if (!own) {
      own = pugi::xml_node(node_).append_copy(offered);
      file_->read.insert(own.internal_object());  // the original is listed if nothing reads it
    }
    file_->origins[own.internal_object()].push_back(offered.internal_object());
  }
}

Finding ModelElement::place() const {
  const auto [line, column] = file_->source.position(offset(node_));
  const pugi::xml_attribute called = node_.attribute("name");
  return {file_->name, line, column, called ? fmt::format("{} '{}'", name(), called.value()) : name(), ""};
}

void ModelElement::error(const std::string& message) const {
  Finding finding = place();
  finding.message = message;
  if (std::ranges::find(file_->findings, finding) == file_->findings.end()) file_->findings.push_back(finding);
}

ModelFile::ModelFile(const std::string& text, std::string file) : name(std::move(file)), source(text) {
  if (const std::size_t bad = source.first_invalid_byte(); bad != std::string::npos)
    refuse_file(*this, bad, "is not UTF-8 here");
  const pugi::xml_parse_result parsed =
      document.load_buffer(source.content().data(), source.content().size(), pugi::parse_default, pugi::encoding_utf8);
  if (!parsed)
    refuse_file(*this, static_cast<std::size_t>(parsed.offset), fmt::format("is no XML: {}", parsed.description()));
  check(*this, document.document_element(), 0);
}

void ModelFile::throw_if_any() const {
  if (!findings.empty()) throw InputError(findings);
}

std::vector<std::string> ModelFile::dropped() const {
  std::vector<std::string> kinds, list;
  add_dropped(*this, document.document_element(), kinds, list);
  return list;
}

}  // namespace mbsopt::inline app
