// Finds the name that a user may have meant, for error messages.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbsopt {

// Returns " (did you mean 'stiffness'?)", or "" if no candidate is near. The Damerau-Levenshtein distance (insertions,
// deletions, substitutions, swaps of neighbours), without case, must be at most a third of the word's length.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

// "a, b, c"
std::string joined(const std::vector<std::string>& words);

}  // namespace mbsopt
