// The name a user may have meant, for error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbsopt {

// " (did you mean 'stiffness'?)", or "" when no candidate is near. Nearness: Damerau-Levenshtein distance (insertions,
// deletions, substitutions, swaps of neighbours), letters' case not counted, at most a third of the word's length.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

// "a, b, c"
std::string joined(const std::vector<std::string>& words);

}  // namespace mbsopt
