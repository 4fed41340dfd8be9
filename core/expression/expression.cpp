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

SyntaxTree tree_of(double value) {
  SyntaxTree tree;
  tree.nodes.emplace_back().value = value;
  tree.text = shortest(value);
  tree.number = value;
  return tree;
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

// Builds an expression from others.
struct ExpressionMaker {
  static Expression of(SyntaxTree tree) {
    complete(tree);
    Expression result;
    result.tree_ = std::make_shared<const SyntaxTree>(std::move(tree));
    return result;
  }
  static Expression of(Operation operation, char sign, const Expression& a, const Expression& b) {
    SyntaxTree tree;
    SyntaxNode node;
    node.operation = operation;
    node.a = append(tree, a);
    node.b = append(tree, b);
    tree.nodes.push_back(std::move(node));
    tree.text = "(" + a.text() + ") " + sign + " (" + b.text() + ")";
    return of(std::move(tree));
  }
};

Expression operator+(const Expression& a, const Expression& b) {
  return ExpressionMaker::of(Operation::add, '+', a, b);
}
Expression operator-(const Expression& a, const Expression& b) {
  return ExpressionMaker::of(Operation::subtract, '-', a, b);
}
Expression operator*(const Expression& a, const Expression& b) {
  return ExpressionMaker::of(Operation::multiply, '*', a, b);
}

Expression Expression::of_curve(std::shared_ptr<const Curve> f, const Expression& argument, std::string_view name) {
  SyntaxTree tree;
  SyntaxNode node;
  node.operation = Operation::curve;
  node.curve = std::move(f);
  node.a = append(tree, argument);
  tree.nodes.push_back(std::move(node));
  tree.text = std::string(name) + "(" + argument.text() + ")";
  return ExpressionMaker::of(std::move(tree));
}

std::vector<CurveCall> curve_calls(const Expression& expression) {
  std::vector<CurveCall> calls;
  for (const SyntaxNode& node : expression.tree().nodes) {
    if (!node.curve) continue;
    SyntaxTree argument;
    argument.nodes.assign(expression.tree().nodes.begin(), expression.tree().nodes.begin() + node.a + 1);
    argument.text = expression.text();
    calls.push_back({node.curve, ExpressionMaker::of(std::move(argument))});
  }
  return calls;
}

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
