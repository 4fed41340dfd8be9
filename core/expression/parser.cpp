// Grammar, by recursive descent:
//   sum     = product { ("+" | "-") product }
//   product = signed  { ("*" | "/") signed }
//   signed  = { "-" | "+" } power
//   power   = primary [ "^" signed ]                    right-associative; -x^2 is -(x^2)
//   curve   = ("spline" | "table") "(" sum "," list "," list ")"        list = "[" sum { "," sum } "]"
//   primary = number [ "[" unit "]" ] | "pi" | name | function "(" sum { "," sum } ")" | "(" sum ")"
#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>
#include <numbers>
#include <set>
#include <span>
#include <stdexcept>
#include <system_error>

#include "core/expression/did_you_mean.hpp"
#include "core/expression/dimension.hpp"
#include "core/expression/expression.hpp"
#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

namespace {

constexpr int kDeepestNesting = 200;
// Each ordinate that is not a number has its own curve through as many samples.
constexpr std::size_t kMostOrdinates = 500;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_space(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// Gives the value of each node; a name has none (NaN).
std::vector<double> values_of(std::span<const SyntaxNode> nodes) {
  std::vector<double> value;
  value.reserve(nodes.size());
  for (const SyntaxNode& node : nodes) {
    const double a = node.a < 0 ? 0 : value[static_cast<std::size_t>(node.a)];
    const double b = node.b < 0 ? 0 : value[static_cast<std::size_t>(node.b)];
    value.push_back(node.operation == Operation::name ? std::numeric_limits<double>::quiet_NaN()
                                                      : value_of(node, a, b));
  }
  return value;
}

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  std::vector<SyntaxNode> run() {
    skip_space();
    if (at_end()) fail("is empty, an expression is expected", 0);
    sum();
    if (!at_end()) fail("expected an operator (+ - * / ^) before " + found() + decimal_comma() + brackets(), at_);
    return std::move(nodes_);
  }

 private:
  int sum() {
    int left = product();
    while (peek() == '+' || peek() == '-') {
      const std::size_t offset = at_;
      const Operation operation = take() == '+' ? Operation::add : Operation::subtract;
      const int right = product();
      left = push(operation, left, right, offset);
    }
    return left;
  }

  int product() {
    int left = signed_power();
    while (peek() == '*' || peek() == '/') {
      const std::size_t offset = at_;
      const Operation operation = take() == '*' ? Operation::multiply : Operation::divide;
      if (peek() == '*') fail("'**' is not an operator, a power is written '^'", offset);
      const int right = signed_power();
      left = push(operation, left, right, offset);
    }
    return left;
  }

  int signed_power() {
    const Nested level(*this);
    if (peek() == '-') {
      const std::size_t offset = at_;
      take();
      return push(Operation::negate, signed_power(), -1, offset);
    }
    if (peek() == '+') {
      take();
      return signed_power();
    }
    return power();
  }

  int power() {
    const int base = primary();
    if (peek() != '^') return base;
    const std::size_t offset = at_;
    take();
    const int exponent = signed_power();
    return push(Operation::power, base, exponent, offset);
  }

  int primary() {
    if (at_end()) fail("ends where a number, a name or '(' is expected", at_);
    if (peek() == '(') return parenthesis();
    if (is_digit(peek()) || peek() == '.') return number();
    if (is_letter(peek())) return name_or_call();
    fail("expected a number, a name or '(', found " + found(), at_);
  }

  int parenthesis() {
    const std::size_t opening = at_;
    take();
    const int inside = sum();
    if (peek() != ')')
      fail(at_end() ? "'(' is never closed" : "expected ')' or an operator, found " + found(),
           at_end() ? opening : at_);
    take();
    return inside;
  }

  int number() {
    const std::size_t offset = at_;
    SyntaxNode node{.offset = offset};
    const char* const first = text_.data() + at_;
    const auto [last, error] = std::from_chars(first, text_.data() + text_.size(), node.value);
    if (error == std::errc::invalid_argument) fail("expected a number, found " + found(), offset);
    const std::string_view literal(first, static_cast<std::size_t>(last - first));
    if (error == std::errc::result_out_of_range)
      fail("the number " + std::string(literal) + " is out of the range of double precision", offset);
    at_ += literal.size();
    if (!at_end() && (is_letter(text_[at_]) || text_[at_] == '.'))
      fail("expected an operator after the number " + std::string(literal) + ", found " + found() + brackets(), at_);
    skip_space();
    if (peek() == '[') unit(node);
    return push(std::move(node));
  }

  void unit(SyntaxNode& node) {
    const std::size_t offset = at_;
    const std::size_t end = text_.find(']', offset);
    if (end == std::string_view::npos) fail("'[' of a unit is never closed", offset);
    const std::string_view name = text_.substr(offset + 1, end - offset - 1);
    const std::optional<Unit> unit = parse_unit(name);
    if (!unit) fail(unknown_unit(name), offset + 1);
    node.value *= unit->to_si;
    node.unit = unit->dimension;
    at_ = end + 1;
    skip_space();
  }

  int name_or_call() {
    const std::size_t offset = at_;
    std::size_t end = at_;
    while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end]))) ++end;
    const std::string name(text_.substr(offset, end - offset));
    at_ = end;
    skip_space();
    if (peek() == '(') return call(name, offset);
    if (peek() == '[') fail("a unit may follow a number only, not the name '" + name + "'", at_);
    if (find_function(name)) fail("'" + name + "' is a function and needs arguments: " + name + "(...)", offset);
    if (name == "pi") return push({.value = std::numbers::pi, .unit = Dimension{}, .offset = offset});
    if (is_not_finite_literal(name)) fail("'" + name + "' is not a finite number", offset);
    return push({.operation = Operation::name, .name = name, .offset = offset});
  }

  int call(const std::string& name, std::size_t offset) {
    const FunctionEntry* const function = find_function(name);
    if (!function) {
      std::vector<std::string> all;
      for (const FunctionEntry& entry : kFunctions) all.emplace_back(entry.name);
      fail("'" + name + "' is not a function" + did_you_mean(name, all) + "; available: " + joined(all), offset);
    }
    if (function->operation == Operation::curve) return curve(name, offset);
    std::vector<int> arguments;
    do {
      take();  // '(' or ','
      if (peek() == ')' && arguments.empty()) break;
      arguments.push_back(sum());
    } while (peek() == ',');
    if (peek() != ')')
      fail(at_end() ? "'(' of " + name + " is never closed" : "expected ',' or ')', found " + found(),
           at_end() ? offset + name.size() : at_);
    take();
    const int count = static_cast<int>(arguments.size());
    if (count < function->least || (function->most >= 0 && count > function->most))
      fail("'" + name + "' takes " + arity(*function) + ", found " + std::to_string(count), offset);
    return lower(*function, arguments, offset);
  }

  // Reads a curve through samples whose ordinates y_j may be expressions. The curve is linear in them:
  //   f(x) = sum_j y_j f_j(x),   f_j the curve through 1 at x_j and 0 at all other abscissae
  int curve(const std::string& name, std::size_t offset) {
    const Nested level(*this);
    const auto next = [&](char expected) {
      if (peek() != expected)
        fail("'" + name + "' is written " + name + "(x, [x0, x1, ...], [y0, y1, ...]); expected '" + expected +
                 "', found " + found(),
             at_);
      take();
    };
    next('(');
    const int x = sum();
    next(',');
    const std::size_t before = nodes_.size(), abscissae_at = at_;
    const std::vector<int> abscissae = list(next);
    if (const SyntaxNode* const node = first_name_from(before))
      fail("'" + node->name + "' is a name; the abscissae of '" + name + "' must be numbers", node->offset);
    const std::vector<double> at = values_at(abscissae);
    next(',');
    const std::size_t ordinates_at = at_, first_ordinate = nodes_.size();
    const std::vector<int> ordinates = list(next);
    next(')');
    if (ordinates.size() != at.size())
      fail("'" + name + "' has " + std::to_string(at.size()) + " abscissae and " + std::to_string(ordinates.size()) +
               " ordinates",
           ordinates_at);
    const Interpolation how = name == "table" ? Interpolation::linear : Interpolation::spline;
    const auto through = [&](std::vector<double> y) {
      try {
        const auto f = std::make_shared<const Curve>(how, at, std::move(y));
        return push({.operation = Operation::curve, .a = x, .curve = f, .offset = offset});
      } catch (const std::invalid_argument& error) {
        fail("'" + name + "': " + error.what(), abscissae_at);
      }
    };
    if (!first_name_from(first_ordinate)) return through(values_at(ordinates));
    if (at.size() > kMostOrdinates)
      fail("'" + name + "' has " + std::to_string(at.size()) + " ordinates that are not all numbers; at most " +
               std::to_string(kMostOrdinates) + " are allowed",
           ordinates_at);
    int total = -1;
    for (std::size_t j = 0; j < at.size(); ++j) {
      std::vector<double> unit(at.size(), 0.0);
      unit[j] = 1;
      const int term = push(Operation::multiply, ordinates[j], through(std::move(unit)), offset);
      total = total < 0 ? term : push(Operation::add, total, term, offset);
    }
    return total;
  }

  const SyntaxNode* first_name_from(std::size_t begin) const {
    const auto found = std::find_if(nodes_.begin() + static_cast<std::ptrdiff_t>(begin), nodes_.end(),
                                    [](const SyntaxNode& node) { return node.operation == Operation::name; });
    return found == nodes_.end() ? nullptr : &*found;
  }

  std::vector<double> values_at(const std::vector<int>& places) const {
    const std::vector<double> all = values_of(nodes_);
    std::vector<double> values;
    for (const int i : places) values.push_back(all[static_cast<std::size_t>(i)]);
    return values;
  }

  std::vector<int> list(const auto& next) {
    std::vector<int> entries;
    next('[');
    while (true) {
      entries.push_back(sum());
      if (peek() != ',') break;
      take();
    }
    next(']');
    return entries;
  }

  // Writes functions that have more or fewer arguments than an operation in terms of operations.
  int lower(const FunctionEntry& function, const std::vector<int>& arguments, std::size_t offset) {
    const auto smoothing = [&] { return push({.value = kSmoothingDefault, .offset = offset}); };
    if (function.name == "smooth_max") {
      const int a = arguments[0], b = arguments[1];
      const int eps = arguments.size() > 2 ? arguments[2] : smoothing();
      const int sum = push(Operation::add, a, b, offset);
      const int difference = push(Operation::subtract, a, b, offset);
      const int distance = push(Operation::smooth_abs, difference, eps, offset);
      const int total = push(Operation::add, sum, distance, offset);
      const int two = push({.value = 2, .unit = Dimension{}, .offset = offset});
      return push(Operation::divide, total, two, offset);
    }
    if (arguments.size() == 1)
      return push(function.operation, arguments[0], function.name == "smooth_abs" ? smoothing() : -1, offset);
    int all = arguments[0];
    for (std::size_t i = 1; i < arguments.size(); ++i) all = push(function.operation, all, arguments[i], offset);
    return all;
  }

  static std::string arity(const FunctionEntry& function) {
    const std::string least = std::to_string(function.least);
    if (function.most < 0) return least + " or more arguments";
    if (function.most == function.least) return least + (function.least == 1 ? " argument" : " arguments");
    return least + " or " + std::to_string(function.most) + " arguments";
  }

  static bool is_not_finite_literal(std::string name) {
    std::transform(name.begin(), name.end(), name.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
    return name == "nan" || name == "inf" || name == "infinity";
  }

  static std::string unknown_unit(std::string_view name) {
    return "'" + std::string(name) + "' is not a known unit; units are products, quotients and whole powers of " +
           known_units() + ", such as N/mm, kg m^2, N s/m or 1/(m s)";
  }

  int push(SyntaxNode node) {
    nodes_.push_back(std::move(node));
    return static_cast<int>(nodes_.size()) - 1;
  }
  int push(Operation operation, int a, int b, std::size_t offset) {
    return push({.operation = operation, .a = a, .b = b, .offset = offset});
  }

  bool at_end() const { return at_ >= text_.size(); }
  char peek() const { return at_end() ? '\0' : text_[at_]; }
  char take() {
    const char c = text_[at_++];
    skip_space();
    return c;
  }
  void skip_space() {
    while (!at_end() && is_space(text_[at_])) ++at_;
  }

  std::string decimal_comma() const {
    const bool inside = at_ > 0 && at_ + 1 < text_.size() && is_digit(text_[at_ - 1]) && is_digit(text_[at_ + 1]);
    return text_[at_] == ',' && inside ? "; decimals have a point" : "";
  }

  // A unit that stands behind a number without its brackets.
  std::string brackets() const {
    std::size_t before = at_, end = at_;
    while (before > 0 && text_[before - 1] == ' ') --before;
    while (end < text_.size() && is_letter(text_[end])) ++end;
    const std::string word(text_.substr(at_, end - at_));
    const bool behind_number = before > 0 && (is_digit(text_[before - 1]) || text_[before - 1] == '.');
    return behind_number && parse_unit(word) ? "; a unit stands in brackets: [" + word + "]" : "";
  }

  std::string found() const {
    if (at_end()) return "the end";
    std::size_t end = at_;
    if (is_letter(text_[end]) || is_digit(text_[end])) {
      while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end]))) ++end;
    } else {
      ++end;
      while (end < text_.size() && (static_cast<unsigned char>(text_[end]) & 0xC0) == 0x80) ++end;  // rest of UTF-8
    }
    return "'" + std::string(text_.substr(at_, end - at_)) + "'";
  }

  [[noreturn]] static void fail(const std::string& what, std::size_t offset) { throw ExpressionError(what, offset); }

  // Brackets, signs and powers nest the functions above; the limit keeps any text from exhausting the stack.
  struct Nested {
    explicit Nested(Parser& owner) : parser(owner) {
      if (++parser.depth_ > kDeepestNesting)
        fail("nests deeper than " + std::to_string(kDeepestNesting) + " levels", parser.at_);
    }
    ~Nested() { --parser.depth_; }
    Nested(const Nested&) = delete;
    Nested& operator=(const Nested&) = delete;
    Parser& parser;
  };

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  std::vector<SyntaxNode> nodes_;
};

}  // namespace

void complete(SyntaxTree& tree) {
  std::set<std::string_view> names;
  for (const SyntaxNode& node : tree.nodes)
    if (node.operation == Operation::name) names.insert(node.name);
  tree.names.assign(names.begin(), names.end());
  if (tree.names.empty()) tree.number = values_of(tree.nodes).back();
}

std::vector<SyntaxNode> parse_expression(std::string_view text) { return Parser(text).run(); }

}  // namespace mbsopt
