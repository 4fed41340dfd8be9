// The physical dimension of an expression, from the units in it and the dimensions of its names.
//
// A plain number fits everything: "L + 3" is a length, and "m*0.5^2/12" may be an inertia, since 0.5 may be a length. A
// name of unknown dimension fits everything, too. Products with either have an unknown dimension, which fits
// everything. Results such as sin(a) or L1/L2 have no dimension and may replace a plain number.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/expression/dimension.hpp"
#include "core/expression/expression.hpp"

namespace mbsopt {

// Reports dimensions that do not fit each other inside an expression, and their place (offset in bytes).
class DimensionError : public std::runtime_error {
 public:
  DimensionError(const std::string& what, std::size_t at) : std::runtime_error(what), offset(at) {}
  std::size_t offset;
};

using DimensionOfName = std::function<std::optional<Dimension>(const std::string& name)>;

// Numbers without units fit everything in a check of dimensions. To find a unit, they are pure: the mean (x1 + x2)/2 of
// two lengths is a length.
enum class PlainNumbers { fit_everything, are_pure };

// Returns nullopt if the dimension is unknown. Throws DimensionError.
std::optional<Dimension> infer_dimension(const Expression& expression, const DimensionOfName& dimension_of_name,
                                         PlainNumbers plain = PlainNumbers::fit_everything);

// Returns whether an expression of that dimension may be the value of a field. Unknown and absent dimensions always
// fit.
bool fits(const std::optional<Dimension>& found, const Dimension& expected);

}  // namespace mbsopt
