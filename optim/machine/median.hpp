// The median; of an even number of values it is the upper of the middle two.
#pragma once

#include <algorithm>
#include <vector>

namespace mbsopt::inline optim {

// Returns 0 if x is empty.
inline double median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace mbsopt::inline optim
