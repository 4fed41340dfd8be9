// Queries of the sweeps on a method's groups of coupled stages (tableaus.hpp).
#pragma once

#include <algorithm>

#include "core/tableau/method.hpp"

namespace mbsopt {

inline bool is_implicit(const Method& rk, const StageGroup& g) { return !rk.is_explicit_stage(g.first); }

// The number of stages of the largest implicit group; 0 if the method is explicit.
inline int largest_implicit_group(const Method& rk) {
  int largest = 0;
  for (const StageGroup& g : rk.stage_groups()) {
    if (is_implicit(rk, g)) largest = std::max(largest, g.size());
  }
  return largest;
}

// Returns whether a step's result depends on the group through its weights, dense output, or later stages. An error
// estimate does not count, because derivatives hold steps fixed.
inline bool is_used(const Method& rk, const StageGroup& g, bool dense) {
  if (dense) return true;
  for (int i = g.first; i <= std::min(g.last, rk.stages - 1); ++i) {
    if (rk.b[i] != 0) return true;
    for (int k = g.last + 1; k < rk.stages; ++k) {
      if (rk.a(k, i) != 0) return true;
    }
  }
  return false;
}

}  // namespace mbsopt
