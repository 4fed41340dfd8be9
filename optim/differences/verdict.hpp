// The result of a comparison of two derivatives.
#pragma once

#include <string_view>

namespace mbsopt::inline optim {

enum class Verdict {
  agrees,  // to the threshold
  buried,  // agrees to the error of the differences alone, which is larger than the threshold
  zero,    // exactly zero by every method
  failed,  // the differences could not be evaluated
  disagrees,
};
std::string_view to_string(
    Verdict verdict);  // in this order: "agrees", "within its error", "zero", "FAILED", "DISAGREES"
// Estimates of errors have the right size but are no bounds. A difference within some times of them is explained.
inline constexpr double kEstimateTrust = 10;

inline bool passes(Verdict verdict) { return verdict != Verdict::failed && verdict != Verdict::disagrees; }

// Compares a derivative that is known to `error` with its expected value: it agrees within threshold * entry. Its own
// error, trusted to some times its estimate, counts only if it hides the entry at this threshold.
Verdict verdict_of(double found, double error, double expected, double entry, double threshold);

}  // namespace mbsopt::inline optim
