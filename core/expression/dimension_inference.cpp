#include "core/expression/dimension_inference.hpp"

#include <cmath>
#include <vector>

#include "core/expression/syntax_tree.hpp"

namespace mbsopt {

namespace {

using Known = std::optional<Dimension>;

constexpr double kLargestExponent = 100;

struct Inferred {
  Known dimension;
  std::optional<double> number = {};  // value of a constant, for exponents
  bool is_plain = false;              // made of numbers without units only
};

bool is_pure(const Known& d) { return d && compatible(*d, Dimension{}); }

// The dimension of operands that must agree, as in sums and minima.
Known agreed(const Known& a, const Known& b, const SyntaxNode& node) {
  if (!a || a->is_none()) return b && !(b->is_none()) ? b : a;
  if (!b || b->is_none()) return a;
  if (!compatible(*a, *b))
    throw DimensionError("combines " + to_string(*a) + " with " + to_string(*b) + ", which must be of one dimension",
                         node.offset);
  return a;
}

void must_be_pure(const Known& d, const char* what, const SyntaxNode& node) {
  if (d && !is_pure(d))
    throw DimensionError(std::string(what) + " must be a pure number or an angle, found " + to_string(*d), node.offset);
}

Known power(const Inferred& base, const Inferred& exponent, const SyntaxNode& node) {
  must_be_pure(exponent.dimension, "an exponent", node);
  if (!base.dimension || base.dimension->is_none()) return base.dimension;
  if (!exponent.number) return std::nullopt;
  const double n = *exponent.number;
  if (n != std::round(n) || std::abs(n) > kLargestExponent) return std::nullopt;  // fractional powers are not followed
  return pow(*base.dimension, static_cast<int>(n));
}

Known of_operation(const SyntaxNode& node, const Inferred& a, const Inferred& b) {
  switch (node.operation) {
    case Operation::negate:
    case Operation::abs:
      return a.dimension;
    case Operation::add:
    case Operation::subtract:
    case Operation::min:
    case Operation::max:
    case Operation::smooth_abs:
      return agreed(a.dimension, b.dimension, node);
    case Operation::multiply:
    case Operation::divide:
      if (!a.dimension || !b.dimension || a.is_plain != b.is_plain) return std::nullopt;
      return node.operation == Operation::multiply ? *a.dimension * *b.dimension : *a.dimension / *b.dimension;
    case Operation::power:
      return power(a, b, node);
    case Operation::sqrt: {
      if (!a.dimension) return std::nullopt;
      Dimension half;
      for (std::size_t i = 0; i < half.power.size(); ++i) {
        if (i < 3 && a.dimension->power[i] % 2 != 0) return std::nullopt;
        half.power[i] = a.dimension->power[i] / 2;
      }
      return half;
    }
    case Operation::curve:
      return std::nullopt;
    case Operation::atan2:
      agreed(a.dimension, b.dimension, node);
      return dimension::kAngle;
    case Operation::asin:
    case Operation::acos:
    case Operation::atan:
      must_be_pure(a.dimension, "the argument of an inverse trigonometric function", node);
      return dimension::kAngle;
    default:
      must_be_pure(a.dimension, "the argument of this function", node);
      return Dimension{};
  }
}

}  // namespace

std::optional<Dimension> infer_dimension(const Expression& expression, const DimensionOfName& dimension_of_name,
                                         PlainNumbers plain) {
  const std::vector<SyntaxNode>& nodes = expression.tree().nodes;
  std::vector<Inferred> inferred;
  inferred.reserve(nodes.size());
  for (const SyntaxNode& node : nodes) {
    Inferred result;
    if (node.operation == Operation::number) {
      result = {node.unit.value_or(Dimension{}), node.value, !node.unit && plain == PlainNumbers::fit_everything};
    } else if (node.operation == Operation::name) {
      result.dimension = dimension_of_name(node.name);
    } else {
      const Inferred& a = inferred[static_cast<std::size_t>(node.a)];
      const Inferred& b = node.b < 0 ? a : inferred[static_cast<std::size_t>(node.b)];
      result.dimension = of_operation(node, a, b);
      if (a.number && b.number) result.number = value_of(node, *a.number, *b.number);
      result.is_plain = a.is_plain && b.is_plain;
    }
    inferred.push_back(result);
  }
  return inferred.back().dimension;
}

bool fits(const std::optional<Dimension>& found, const Dimension& expected) {
  return !found || found->is_none() || compatible(*found, expected);
}

}  // namespace mbsopt
