// Tells whether a tensor can be the inertia of a body.
//   The principal moments J1 <= J2 <= J3 of any distribution of mass are >= 0 and J3 <= J1 + J2.
#pragma once

#include <array>
#include <string>

namespace mbsopt {

// The tensor is xx yy zz xy xz yz. Returns the fault in words, or an empty string. The tolerance is 1e-6 of the trace,
// so that tensors written with seven digits pass.
std::string inertia_problem(const std::array<double, 6>& tensor);

}  // namespace mbsopt
