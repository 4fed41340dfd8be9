// The objectives that are a mean over the simulated time T. A new kind is a row of the table. A row of
// tests/optim/objective/objective_test.cpp tests it.
//
//   psi = N(I/T),   I = integral of M(x) dt,   x an expression, N the inverse of M
//   maximum_of   M = exp(k x)    N = log(m)/k    k = sharpness        minimum_of   the same with k = -sharpness
//   rms_of       M = x^2         N = sqrt(m)
//   peak_to_peak_of   psi = maximum_of - minimum_of, two such means
//
// An extreme is the same for every x0 in M(x - x0), x0 + N: x0 keeps exp within the range of numbers.
#pragma once

#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include "core/expression/expression.hpp"

namespace mbsopt::inline optim {

// A function of one number, and its first two derivatives.
struct Derivatives {
  double value, first, second;
};

enum class Extreme { none, maximum, minimum, both };

struct MeanKind {
  std::string_view name, description;
  Derivatives (*M)(double x, double k);
  Derivatives (*N)(double m, double k);
  Extreme extreme = Extreme::none;
};

inline Derivatives exponential(double x, double k) {
  const double e = std::exp(k * x);
  return {e, k * e, k * k * e};
}
inline Derivatives logarithm(double m, double k) { return {std::log(m) / k, 1 / (k * m), -1 / (k * m * m)}; }
inline Derivatives square(double x, double) { return {x * x, 2 * x, 2}; }
// At 0 there is no derivative; it is given as 0. Methods with negative weights may sum squares to -1e-33.
inline Derivatives root(double m, double) {
  if (m <= 0) return {0, 0, 0};
  const double x = std::sqrt(m);
  return {x, 0.5 / x, -0.25 / (x * m)};
}

inline constexpr MeanKind kMeanKinds[] = {
    {"maximum_of", "alone: its largest value over time, smoothed by sharpness", exponential, logarithm,
     Extreme::maximum},
    {"minimum_of", "alone: its smallest value over time, smoothed by sharpness", exponential, logarithm,
     Extreme::minimum},
    {"peak_to_peak_of", "alone: its largest less its smallest value over time, smoothed by sharpness", exponential,
     logarithm, Extreme::both},
    {"rms_of", "alone: root of its mean square over time", square, root},
};

// An expression per kind. An objective, or a limit, gives at most one of them.
using Means = std::array<std::optional<Expression>, std::size(kMeanKinds)>;

// The kind that is given, or null; the first one if there are several.
inline const MeanKind* given_kind(const Means& means) {
  for (std::size_t k = 0; k < means.size(); ++k)
    if (means[k]) return &kMeanKinds[k];
  return nullptr;
}
inline bool is_extreme(const Means& means) {
  const MeanKind* const kind = given_kind(means);
  return kind && kind->extreme != Extreme::none;
}
// The expression of a kind, such as "rms_of".
auto& mean_of(auto& means, std::string_view kind) {
  std::size_t k = 0;
  while (kMeanKinds[k].name != kind) ++k;
  return means[k];
}

}  // namespace mbsopt::inline optim
