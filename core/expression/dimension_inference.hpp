// The physical dimension of an expression, from the units written in it and the dimensions of its names.
//
// A plain number is a pure number in a product ("L/2" is a length) and takes the dimension of its neighbours everywhere
// else ("L + 3", or a field that is just "3"). So does any result without a dimension, such as sin(a) or L1/L2. A name
// whose dimension is not known makes what is computed from it unknown, and unknown fits everything.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/expression/dimension.hpp"
#include "core/expression/expression.hpp"

namespace mbsopt {

// Dimensions that do not fit each other inside an expression, and where (offset in bytes).
class DimensionError : public std::runtime_error {
 public:
  DimensionError(const std::string& what, std::size_t at) : std::runtime_error(what), offset(at) {}
  std::size_t offset;
};

using DimensionOfName = std::function<std::optional<Dimension>(const std::string& name)>;

// nullopt: not known. Throws DimensionError.
std::optional<Dimension> infer_dimension(const Expression& expression, const DimensionOfName& dimension_of_name);

// Whether an expression of that dimension may stand in a field; a dimension that is not known or none always may.
bool fits(const std::optional<Dimension>& found, const Dimension& expected);

}  // namespace mbsopt
