// A parsed expression: its operations in the order of evaluation. Operands come before the operation that uses them,
// and several operations may share them. So one loop reads a tree of any depth.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/curve.hpp"
#include "core/expression/dimension.hpp"
#include "core/expression/operation.hpp"

namespace mbsopt {

struct SyntaxNode {
  Operation operation = Operation::number;
  int a = -1, b = -1;                       // operands: earlier nodes
  double value = 0;                         // of a number, in SI
  std::optional<Dimension> unit = {};       // of a number with a unit; without, it may have any dimension
  std::string name = {};                    // of a name
  std::shared_ptr<const Curve> curve = {};  // of a curve
  std::size_t offset = 0;                   // its place in the text [bytes]
};

struct SyntaxTree {
  std::vector<SyntaxNode> nodes = {};  // the last one is the whole expression
  std::string text = {};
  std::vector<std::string> names = {};  // free names, sorted, each once
  std::optional<double> number = {};    // the value, where there are no names
};

// The value of a node whose operands have the values a and b. The node must not be a name.
inline double value_of(const SyntaxNode& node, double a, double b) {
  if (node.operation == Operation::number) return node.value;
  return node.curve ? node.curve->at(a) : apply(node.operation, a, b);
}

// Collects the names in the tree's nodes, and computes its value if there are none.
void complete(SyntaxTree& tree);

std::vector<SyntaxNode> parse_expression(std::string_view text);  // throws ExpressionError

}  // namespace mbsopt
