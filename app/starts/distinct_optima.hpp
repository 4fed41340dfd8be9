// The distinct optima at which the starts of a multistart ended, and the expected number of others.
//
// Assume that every start ends at the optimum of its region, and that the sizes of these regions are unknown. If n
// searches ended at w optima, then the expected number of all optima, and the expected share of known regions, are
//
//   w (n - 1)/(n - w - 2), n > w + 2         (n - w - 1)(n + w)/(n (n - 1))
//
// C. G. E. Boender, A. H. G. Rinnooy Kan, "Bayesian stopping rules for multistart global optimization methods",
// Mathematical Programming 37 (1987) 59-80. The search ends when the first is below w + 1/2 in each assembly mode. Each
// mode has its own optima, and a mode in which few searches converge tells little of them.
#pragma once

#include <optional>
#include <vector>

#include "app/files/result_json.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::inline app {

inline constexpr double kFeasible = 1e-6;  // violation relative to the bounds: what ranks as feasible

// Returns whether a start converged with all limits held.
bool is_an_optimum(const Json& record);

// Returns whether two optima agree within 1e-3 of the range of each bounded parameter, or of its logarithm if that is
// the scale. Parameters of the unit rad, or of none, may differ by whole turns if the objectives are the same.
bool same_optimum(const Json& a, const Json& b, const Scene& scene);

struct DistinctOptimum {
  const Json* best = nullptr;  // record of the best start that ended there
  long starts = 0;
};

// Collects the optima of the records that converged with all limits held, in their order.
std::vector<DistinctOptimum> distinct_optima(const std::vector<Json>& ranked, const Scene& scene);

struct SearchedOptima {
  long searches = 0, optima = 0;
  std::optional<double> expected() const;  // optima in all; none: too few searches
  double covered() const;                  // part of the searches to come
  bool all_found() const { return expected() && *expected() < static_cast<double>(optima) + 0.5; }
};
SearchedOptima searched(const std::vector<DistinctOptimum>& optima);

// Returns whether the rule holds in each searched assembly mode.
bool all_found(const std::vector<Json>& ranked, const Scene& scene);

}  // namespace mbsopt::inline app
