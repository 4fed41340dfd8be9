// The result of a comparison of two derivatives.
#pragma once

#include <cmath>
#include <cstddef>
#include <string_view>

namespace mbsopt::inline optim {

enum class Verdict {
  agrees,  // to the threshold
  buried,  // agrees to the error of the differences alone, which is larger than the threshold
  zero,    // exactly zero by every method
  failed,  // the differences could not be evaluated
  disagrees,
};
inline std::string_view to_string(Verdict verdict) {
  constexpr std::string_view kNames[] = {"agrees", "within its error", "zero", "FAILED", "DISAGREES"};
  return kNames[static_cast<std::size_t>(verdict)];
}

// Estimates of errors have the right size but are no bounds. A difference within some times of them is explained.
inline constexpr double kEstimateTrust = 10;

inline bool passes(Verdict verdict) { return verdict != Verdict::failed && verdict != Verdict::disagrees; }

// Compares a derivative that is known to `error` with its expected value: it agrees within threshold * entry. Its own
// error, trusted to some times its estimate, counts only if it hides the entry at this threshold.
inline Verdict verdict_of(double found, double error, double expected, double entry, double threshold) {
  if (!std::isfinite(found)) return Verdict::failed;
  if (entry == 0 && found == 0) return Verdict::zero;
  const double apart = std::abs(found - expected);
  if (apart <= threshold * entry) return Verdict::agrees;
  const double own = kEstimateTrust * error;
  if (own > threshold * entry && apart <= own) return Verdict::buried;
  return Verdict::disagrees;
}

}  // namespace mbsopt::inline optim
