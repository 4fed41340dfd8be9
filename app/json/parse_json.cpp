#include "app/json/parse_json.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <unordered_set>

namespace mbsopt {

namespace {

constexpr std::size_t kDeepestNesting = 100;

// The tokens of a JSON text in their order: brackets, strings, numbers and literals, without commas and colons.
class TokenScan {
 public:
  explicit TokenScan(std::string_view text, std::size_t begin = 0) : text_(text), at_(begin) {
    if (begin == 0 && text.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  struct Token {
    std::size_t begin, end;
  };
  Token next() {
    skip();
    const std::size_t begin = at_;
    if (at_ >= text_.size()) return {begin, begin};
    const char c = text_[at_++];
    if (c == '"') {
      while (at_ < text_.size() && text_[at_] != '"') at_ += text_[at_] == '\\' ? 2 : 1;
      ++at_;
    } else if (std::string_view("{}[]").find(c) == std::string_view::npos) {
      at_ = std::min(text_.find_first_of(" \t\r\n,:{}[]\"/", at_), text_.size());
    }
    at_ = std::min(at_, text_.size());
    return {begin, at_};
  }

 private:
  void skip() {
    while (at_ < text_.size()) {
      if (std::string_view(" \t\r\n,:").find(text_[at_]) != std::string_view::npos)
        ++at_;
      else if (text_.compare(at_, 2, "//") == 0)
        at_ = std::min(text_.find('\n', at_), text_.size());
      else if (text_.compare(at_, 2, "/*") == 0)
        at_ = std::min(text_.find("*/", at_ + 2), text_.size() - 2) + 2;
      else
        return;
    }
  }

  std::string_view text_;
  std::size_t at_;
};

class NodeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  NodeBuilder(std::string_view text, Findings* findings) : scan_(text), text_(text), findings_(findings) {}

  Node root;

  bool null() override { return scalar(Node::Kind::null), true; }
  bool boolean(bool value) override { return scalar(Node::Kind::boolean).boolean = value, true; }
  bool number_integer(number_integer_t value) override { return number(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return number(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return number(value); }
  bool string(string_t& value) override { return scalar(Node::Kind::string).string = std::move(value), true; }
  bool binary(binary_t&) override { return false; }

  bool start_object(std::size_t) override { return open(Node::Kind::object); }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(Node::Kind::array); }
  bool end_array() override { return close(); }

  bool key(string_t& value) override {
    const TokenScan::Token token = scan_.next();
    Level& level = levels_.back();
    if (!level.keys.insert(value).second) {
      if (findings_)
        findings_->add_at(token.begin, child_path(level.path, value), "this key is there twice; a key is allowed once");
      level.repeated.push_back(level.node.keys.size());
    }
    level.node.keys.push_back(std::move(value));
    level.node.key_offsets.push_back(token.begin);
    return true;
  }

  bool parse_error(std::size_t position, const std::string&, const nlohmann::json::exception& error) override {
    if (findings_) {
      const std::size_t begin = place(position, error.what());
      findings_->add_at(begin, "", message(begin, error.what()));
    }
    return false;
  }

 private:
  struct Level {
    Node node;
    std::string path;
    std::unordered_set<std::string> keys;
    std::vector<std::size_t> repeated;  // repeated keys of the node
  };

  bool number(double value) { return scalar(Node::Kind::number).number = value, true; }

  Node& scalar(Node::Kind kind) {
    const TokenScan::Token token = scan_.next();
    Node node;
    node.kind = kind;
    node.begin = token.begin;
    node.end = token.end;
    return attach(std::move(node));
  }

  bool open(Node::Kind kind) {
    const TokenScan::Token token = scan_.next();
    if (levels_.size() >= kDeepestNesting) {
      if (findings_)
        findings_->add_at(token.begin, "", "nests deeper than " + std::to_string(kDeepestNesting) + " levels");
      return false;
    }
    Level level;
    level.path = path_of_next();
    level.node.kind = kind;
    level.node.begin = token.begin;
    levels_.push_back(std::move(level));
    return true;
  }

  bool close() {
    Node node = std::move(levels_.back().node);
    const std::vector<std::size_t> repeated = std::move(levels_.back().repeated);
    levels_.pop_back();
    if (!repeated.empty()) leave_out(repeated, node);  // reported: nothing else is to stumble over them
    node.end = scan_.next().end;
    attach(std::move(node));
    return true;
  }

  // Removes keys of an object by ascending numbers.
  static void leave_out(const std::vector<std::size_t>& numbers, Node& node) {
    std::size_t kept = 0;
    auto next = numbers.begin();
    for (std::size_t i = 0; i < node.keys.size(); ++i) {
      if (next != numbers.end() && i == *next) {
        ++next;
        continue;
      }
      if (i != kept) {
        node.keys[kept] = std::move(node.keys[i]);
        node.key_offsets[kept] = node.key_offsets[i];
        node.items[kept] = std::move(node.items[i]);
      }
      ++kept;
    }
    node.keys.resize(kept), node.key_offsets.resize(kept), node.items.resize(kept);
  }

  Node& attach(Node node) {
    if (levels_.empty()) return root = std::move(node);
    return levels_.back().node.items.emplace_back(std::move(node));
  }

  std::string path_of_next() const {
    if (levels_.empty()) return "";
    const Level& level = levels_.back();
    return level.node.kind == Node::Kind::object ? child_path(level.path, level.node.keys.back())
                                                 : child_path(level.path, level.node.items.size());
  }

  // nlohmann reports how many bytes it has read, up to the last one of the faulty token.
  std::size_t place(std::size_t position, const std::string& what) const {
    if (position == 0 || what.find("unexpected end of input") != std::string::npos) return text_.size();
    const std::size_t last_byte = std::min(position, text_.size()) - 1;
    if (text_[last_byte] == ',' || text_[last_byte] == ':') return last_byte;
    TokenScan scan(text_);
    std::size_t begin = 0;
    for (TokenScan::Token token = scan.next(); token.begin <= last_byte && token.begin < token.end; token = scan.next())
      begin = token.begin;
    return begin;
  }

  std::string message(std::size_t begin, std::string what) const {
    const std::string token(text_.substr(begin, TokenScan(text_, begin).next().end - begin));
    for (const std::string_view word : {"NaN", "nan", "Infinity", "infinity", "Inf", "inf"})
      if (token == word || (token.starts_with('-') && token.substr(1) == word))
        return token + " is not a number; numbers must be finite";
    if (what.find("number overflow") != std::string::npos)
      return "the number " + token + " is out of the range of double precision";
    const std::size_t colon = what.find(": ", what.find("column"));  // after "... at line 1, column 2"
    if (colon != std::string::npos) what = what.substr(colon + 2);
    return "is not JSON: " + what + comma_hint(begin, what);
  }

  // nlohmann reports the token that it expected. Mostly a comma is missing, or one is superfluous.
  std::string comma_hint(std::size_t begin, const std::string& what) const {
    const bool in_object = what.find("expected '}'") != std::string::npos;
    const bool in_list = what.find("expected ']'") != std::string::npos;
    const char found = begin < text_.size() ? text_[begin] : ' ';
    const bool closes = found == '}' || found == ']';
    if ((in_object || in_list) && !closes && found != ':' && found != ' ') return " (is a comma missing before it?)";
    const std::size_t before = text_.find_last_not_of(" \t\r\n", begin == 0 ? 0 : begin - 1);
    if (closes && before != std::string_view::npos && before < begin && text_[before] == ',')
      return " (is there a comma too many before it?)";
    return "";
  }

  TokenScan scan_;
  std::string_view text_;
  Findings* findings_;
  std::vector<Level> levels_;
};

bool is_blank(std::string_view text) {
  return text.find_first_not_of(" \t\r\n", text.starts_with("\xEF\xBB\xBF") ? 3 : 0) == std::string_view::npos;
}

void set_source(Node& node, int source) {
  node.source = source;
  for (Node& item : node.items) set_source(item, source);
}

}  // namespace

Node parse_json(Findings& findings) {
  const std::string& text = findings.text().content();
  if (const std::size_t invalid = findings.text().first_invalid_byte(); invalid != std::string::npos) {
    constexpr std::array<char, 16> kHex{'0', '1', '2', '3', '4', '5', '6', '7', '8', '9', 'A', 'B', 'C', 'D', 'E', 'F'};
    const auto byte = static_cast<unsigned char>(text[invalid]);
    findings.add_at(invalid, "", std::string("is not UTF-8 text: byte 0x") + kHex[byte / 16] + kHex[byte % 16]);
    findings.throw_if_any();
  }
  if (const std::size_t nul = text.find('\0'); nul != std::string::npos) {  // nlohmann would take it for the end
    findings.add_at(nul, "", "is not JSON: byte 0x00");
    findings.throw_if_any();
  }
  if (is_blank(text)) {
    findings.add_at(0, "", "is empty, an object { ... } is expected");
    findings.throw_if_any();
  }
  NodeBuilder builder(text, &findings);
  const bool good = nlohmann::json::sax_parse(text, &builder, nlohmann::json::input_format_t::json, true, true);
  if (!good) findings.throw_if_any();
  return std::move(builder.root);
}

Node parse_override_value(const std::string& text, int source) {
  NodeBuilder builder(text, nullptr);
  Node node;
  if (nlohmann::json::sax_parse(text, &builder, nlohmann::json::input_format_t::json, true, true)) {
    node = std::move(builder.root);
  } else {
    node.kind = Node::Kind::string;
    node.string = text;
  }
  set_source(node, source);
  return node;
}

}  // namespace mbsopt
