#include "core/expression/expression.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>

#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

namespace {

std::string shortest(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  assert(error == std::errc());
  return {buffer, end};
}

SyntaxTree tree_of(double value) {
  SyntaxTree tree;
  tree.nodes.emplace_back().value = value;
  tree.text = shortest(value);
  tree.number = value;
  return tree;
}

}  // namespace

Expression::Expression(double value) : tree_(std::make_shared<const SyntaxTree>(tree_of(value))) {}

Expression Expression::parse(std::string_view text) {
  Expression expression;
  expression.tree_ = std::make_shared<const SyntaxTree>(parse_expression(text));
  return expression;
}

bool Expression::is_number() const { return tree_->number.has_value(); }

double Expression::number() const {
  assert(is_number());
  return *tree_->number;
}

const std::string& Expression::text() const { return tree_->text; }

const std::vector<std::string>& Expression::names() const { return tree_->names; }

bool Expression::depends_on(std::string_view name) const {
  return std::binary_search(tree_->names.begin(), tree_->names.end(), name);
}

}  // namespace mbsopt
