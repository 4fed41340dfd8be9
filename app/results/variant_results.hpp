// The comparison of two fits to the same data: identify --compare.
#pragma once

#include <ostream>
#include <string>

#include "app/files/result_json.hpp"
#include "optim/fit/variant_comparison.hpp"

namespace mbsopt {

struct Variant {
  std::string name;
  const IdentificationResult& fit;
};

void print_comparison(std::ostream& out, const Variant& first, const Variant& second);
// comparison
void add_comparison(Json& result, const Variant& first, const Variant& second);

}  // namespace mbsopt
