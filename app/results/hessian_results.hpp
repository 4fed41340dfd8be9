// Second derivatives as `gradient --hessian` shows them: into result.json, and as tables for people.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/files/result_json.hpp"
#include "optim/objective/hessian.hpp"

namespace mbsopt {

// objectives.<name>.hessian {p: {q: value}} and .hessian_error, methods.hessian, hessian_method.
void add_hessians(Json& result, const Hessians& hessians, const std::vector<std::string>& objectives,
                  const std::vector<std::string>& parameters);

// Per objective its lower triangle, six columns at a time, and how well it is known.
void print_hessians(std::ostream& out, const Hessians& hessians, const std::vector<std::string>& objectives,
                    const std::vector<std::string>& parameters);

// Sentences about Hessians that differences could not find well; empty where all is well.
std::vector<std::string> hessian_warnings(const Hessians& hessians, const std::vector<std::string>& objectives);

}  // namespace mbsopt
