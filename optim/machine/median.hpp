// The median: of an even number, the upper of the two in the middle.
#pragma once

#include <algorithm>
#include <vector>

namespace mbsopt {

// 0 where there is none.
inline double median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

}  // namespace mbsopt
