#include "core/expression/expression.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <utility>

#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

namespace {

std::string shortest(double value) {
  char buffer[32];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, value);
  assert(error == std::errc());
  return {buffer, end};
}

// Appends the nodes of an expression, and returns the index of its last node.
int append(SyntaxTree& tree, const Expression& expression) {
  const int shift = static_cast<int>(tree.nodes.size());
  for (SyntaxNode node : expression.tree().nodes) {
    if (node.a >= 0) node.a += shift;
    if (node.b >= 0) node.b += shift;
    tree.nodes.push_back(std::move(node));
  }
  return static_cast<int>(tree.nodes.size()) - 1;
}

}  // namespace

Expression::Expression(SyntaxTree tree) {
  complete(tree);
  tree_ = std::make_shared<const SyntaxTree>(std::move(tree));
}

Expression::Expression(double value) : Expression(SyntaxTree{{{.value = value}}, shortest(value)}) {}

Expression Expression::parse(std::string_view text) { return Expression({parse_expression(text), std::string(text)}); }

Expression Expression::of_curve(std::shared_ptr<const Curve> f, const Expression& argument, std::string_view name) {
  SyntaxTree tree;
  const int a = append(tree, argument);
  tree.nodes.push_back({.operation = Operation::curve, .a = a, .curve = std::move(f)});
  tree.text = std::string(name) + "(" + argument.text() + ")";
  return Expression(std::move(tree));
}

// Joins two expressions.
struct Operator {
  Operation operation;
  char sign;
  Expression operator()(const Expression& left, const Expression& right) const {
    SyntaxTree tree;
    const int a = append(tree, left), b = append(tree, right);
    tree.nodes.push_back({.operation = operation, .a = a, .b = b});
    tree.text = "(" + left.text() + ") " + sign + " (" + right.text() + ")";
    return Expression(std::move(tree));
  }
};

Expression operator+(const Expression& a, const Expression& b) { return Operator{Operation::add, '+'}(a, b); }
Expression operator-(const Expression& a, const Expression& b) { return Operator{Operation::subtract, '-'}(a, b); }
Expression operator*(const Expression& a, const Expression& b) { return Operator{Operation::multiply, '*'}(a, b); }

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
