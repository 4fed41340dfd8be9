#include "optim/differences/verdict.hpp"

#include <cmath>

namespace mbsopt::inline optim {

std::string_view to_string(Verdict verdict) {
  constexpr std::string_view kNames[] = {"agrees", "within its error", "zero", "FAILED", "DISAGREES"};
  return kNames[static_cast<std::size_t>(verdict)];
}

Verdict verdict_of(double found, double error, double expected, double entry, double threshold) {
  if (!std::isfinite(found)) return Verdict::failed;
  if (entry == 0 && found == 0) return Verdict::zero;
  const double apart = std::abs(found - expected);
  if (apart <= threshold * entry) return Verdict::agrees;
  const double own = kEstimateTrust * error;
  if (own > threshold * entry && apart <= own) return Verdict::buried;
  return Verdict::disagrees;
}

}  // namespace mbsopt::inline optim
