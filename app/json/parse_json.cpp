#include "app/json/parse_json.hpp"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <unordered_set>

#include "app/json/source_text.hpp"

namespace mbsopt::inline app {

namespace {

constexpr int kDeepestNesting = 100;
constexpr std::string_view kBlanks = " \t\r\n";

struct JsonFault {
  std::size_t at;
  std::string message;
};

// Objects, lists and comments, by recursive descent. Throws a JsonFault where the text is no JSON.
class JsonParser {
 public:
  // Nodes get this source. findings receives keys that are in an object twice. The later ones are left out.
  JsonParser(std::string_view text, int source, Findings* findings)
      : text_(text), source_(source), findings_(findings) {}

  Node document() {
    if (text_.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
    if (text_.find_first_not_of(kBlanks, at_) == std::string_view::npos)
      throw JsonFault{0, "is empty, an object { ... } is expected"};
    Node node = value();
    if (next() != '\0') expected("the end");
    return node;
  }

 private:
  [[noreturn]] void expected(const std::string& what, const char* hint = "") const {
    const std::size_t before = at_ == 0 ? std::string_view::npos : text_.find_last_not_of(kBlanks, at_ - 1);
    if (closes() && before != std::string_view::npos && text_[before] == ',')
      hint = " (is there a comma too many before it?)";
    const std::string found = at_ == text_.size() ? "the end" : fmt::format("'{:.40}'", token());
    throw JsonFault{at_, fmt::format("is not JSON: found {}, expected {}{}", found, what, hint)};
  }

  bool closes() const { return at_ < text_.size() && (text_[at_] == '}' || text_[at_] == ']'); }

  // Passes blanks and comments. Returns the character after them, or NUL at the end of the text.
  char next() {
    for (;;) {
      at_ = std::min(text_.find_first_not_of(kBlanks, at_), text_.size());
      const std::string_view start = text_.substr(at_, 2);
      if (start != "//" && start != "/*") return start.empty() ? '\0' : start[0];
      const std::size_t end = start == "//" ? text_.find_first_of("\r\n", at_) : text_.find("*/", at_ + 2) + 2;
      if (start == "/*" && end == std::string_view::npos + 2)
        throw JsonFault{at_, "is not JSON: the comment has no end"};
      at_ = std::min(end, text_.size());
    }
  }

  // The string, word or single character here.
  std::string_view token() const {
    std::size_t end = at_ + 1;
    if (text_[at_] == '"') {
      while (end < text_.size() && text_[end] != '"') end += text_[end] == '\\' ? 2 : 1;
      ++end;
    } else if (!closes()) {
      end = std::max(end, text_.find_first_of(" \t\r\n,:{}[]\"/", at_));
    }
    return text_.substr(at_, end - at_);
  }

  Node value() {
    const char first = next();
    Node node;
    node.source = source_;
    node.begin = at_;
    if (first == '{' || first == '[') {
      if (open_.size() == kDeepestNesting)
        throw JsonFault{at_, fmt::format("nests deeper than {} levels", kDeepestNesting)};
      open_.push_back({&node, ""});
      node.kind = first == '{' ? Node::Kind::object : Node::Kind::array;
      read_items(node);
      open_.pop_back();
    } else {
      const nlohmann::json scalar = read_scalar();
      if (scalar.is_string()) {
        node.kind = Node::Kind::string;
        node.string = scalar.get<std::string>();
      } else if (scalar.is_boolean()) {
        node.kind = Node::Kind::boolean;
        node.boolean = scalar.get<bool>();
      } else if (scalar.is_number()) {
        node.kind = Node::Kind::number;
        node.number = scalar.get<double>();
      }
    }
    node.end = at_;
    return node;
  }

  void read_items(Node& node) {
    const bool object = node.kind == Node::Kind::object;
    const char close = object ? '}' : ']';
    std::unordered_set<std::string> keys;
    ++at_;
    for (bool more = next() != close; more;) {
      std::size_t key_begin = 0;
      bool twice = false;
      if (object) {
        if (next() != '"') expected("a name in double quotes");
        key_begin = at_;
        open_.back().key = read_scalar().get<std::string>();
        twice = !keys.insert(open_.back().key).second;
        if (twice && findings_) findings_->add_at(key_begin, path(), "this key is there twice; a key is allowed once");
        if (next() != ':') expected("':'");
        ++at_;
      }
      Node item = value();
      item.key = open_.back().key;
      item.key_begin = key_begin;
      if (!twice) node.items.push_back(std::move(item));  // else it is reported: nothing else is to stumble over it
      const char after = next();
      more = after == ',';
      if (!more && after != close)
        expected(fmt::format("',' or '{}'", close),
                 closes() || after == ':' || after == '\0' ? "" : " (is a comma missing before it?)");
      if (more) ++at_;
    }
    ++at_;
  }

  std::string path() const {
    std::string path;
    for (const auto& [node, key] : open_)
      path = node->kind == Node::Kind::object ? child_path(path, key) : child_path(path, node->items.size());
    return path;
  }

  // nlohmann's parser decides what a string, a number or a literal is. Strings without escapes need none.
  nlohmann::json read_scalar() {
    if (at_ == text_.size()) expected("a value");
    const std::string_view word = token();
    const auto is_plain = [](char c) { return c != '\\' && static_cast<unsigned char>(c) >= 0x20; };
    if (word.size() > 1 && word.front() == '"' && word.back() == '"' && std::ranges::all_of(word, is_plain)) {
      at_ += word.size();
      return std::string(word.substr(1, word.size() - 2));
    }
    nlohmann::json scalar = nlohmann::json::parse(word, nullptr, false);
    if (scalar.is_discarded()) {
      double number = 0;
      const bool all =
          fast_float::from_chars(word.data(), word.data() + word.size(), number).ptr == word.data() + word.size();
      if (!all || std::isfinite(number))
        expected(word[0] == '"' ? "a string on one line, with valid escapes and a closing quote" : "a value");
      const bool digits = word.find_first_of("0123456789") != std::string_view::npos;
      throw JsonFault{at_, digits ? fmt::format("the number {} is out of the range of double precision", word)
                                  : fmt::format("{} is not a number; numbers must be finite", word)};
    }
    at_ += word.size();
    return scalar;
  }

  std::string_view text_;
  int source_;
  Findings* findings_;
  std::size_t at_ = 0;
  struct Open {
    const Node* node;
    std::string key;  // of the value that is read in it
  };
  std::vector<Open> open_;  // objects and lists around the place
};

}  // namespace

Node parse_json(Findings& findings) {
  const std::string& text = findings.text().content();
  try {
    if (const std::size_t bad = findings.text().first_invalid_byte(); bad != std::string::npos)
      throw JsonFault{bad, fmt::format("is not UTF-8 text: byte 0x{:02X}", static_cast<unsigned char>(text[bad]))};
    if (const std::size_t nul = text.find('\0'); nul != std::string::npos)
      throw JsonFault{nul, "is not JSON: byte 0x00"};
    return JsonParser(text, 0, &findings).document();
  } catch (const JsonFault& fault) {
    findings.add_at(fault.at, "", fault.message);
    findings.throw_if_any();
    throw;
  }
}

Node parse_override_value(const std::string& text, int source) {
  try {
    return JsonParser(text, source, nullptr).document();
  } catch (const JsonFault&) {
    Node node;
    node.kind = Node::Kind::string;
    node.string = text;
    node.source = source;
    return node;
  }
}

}  // namespace mbsopt::inline app
