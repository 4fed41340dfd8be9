// A numeric field as a user writes it: a number, or an expression over names ("rho*L1*w^2").
// An Expression is an immutable syntax tree, cheap to copy; it is evaluated by compiling it (program.hpp).
//
//   Expression e = Expression::parse("m*g*l/2 + 3 [cm]");
//   e.names();    // {"g", "l", "m"}
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace mbsopt {

class Curve;        // curve.hpp
struct SyntaxTree;  // syntax_tree.hpp

// Reports a text that is not an expression: the fault and its place (offset in bytes from the start of the text).
class ExpressionError : public std::runtime_error {
 public:
  ExpressionError(const std::string& what, std::size_t at) : std::runtime_error(what), offset(at) {}
  std::size_t offset;
};

class Expression {
 public:
  Expression() : Expression(0.0) {}
  Expression(double value);  // NOLINT: a number is an expression
  // docs/expressions.md describes the grammar. Throws ExpressionError.
  static Expression parse(std::string_view text);

  // f(argument), f a function through samples; the text calls it `name`.
  static Expression of_curve(std::shared_ptr<const Curve> f, const Expression& argument, std::string_view name);

  bool is_number() const;                         // a plain constant: no names, already folded
  double number() const;                          // its value; only where is_number()
  const std::string& text() const;                // as written (a number: shortest form that reads back the same)
  const std::vector<std::string>& names() const;  // free names, sorted, each once
  bool depends_on(std::string_view name) const;
  const SyntaxTree& tree() const { return *tree_; }

 private:
  friend struct Operator;                // expression.cpp
  explicit Expression(SyntaxTree tree);  // of nodes and text
  std::shared_ptr<const SyntaxTree> tree_;
};

Expression operator+(const Expression& a, const Expression& b);
Expression operator-(const Expression& a, const Expression& b);
Expression operator*(const Expression& a, const Expression& b);

}  // namespace mbsopt
