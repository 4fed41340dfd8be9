// Second derivatives of `gradient --hessian`: into result.json, and as tables for people.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/objective/hessian.hpp"

namespace mbsopt {

// Writes objectives.<name>.hessian {p: {q: value}} and .hessian_error, methods.hessian, hessian_method.
void add_hessians(Json& result, const Hessians& hessians, const std::vector<std::string>& objectives,
                  const std::vector<std::string>& parameters);

// Prints, per objective, its lower triangle, six columns at a time, and its accuracy.
void print_hessians(std::ostream& out, const Hessians& hessians, const std::vector<std::string>& objectives,
                    const std::vector<std::string>& parameters);

// Returns sentences about Hessians that differences did not determine well, or nothing.
std::vector<std::string> hessian_warnings(const Hessians& hessians, const std::vector<std::string>& objectives);

}  // namespace mbsopt
