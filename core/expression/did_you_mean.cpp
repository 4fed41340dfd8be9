#include "core/expression/did_you_mean.hpp"

#include <algorithm>
#include <cctype>
#include <limits>

namespace mbsopt {

namespace {

constexpr std::size_t kLongestWord = 64;  // longer ones are not typing errors

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

std::size_t distance(std::string_view a, std::string_view b) {
  std::size_t d[kLongestWord + 1][kLongestWord + 1];  // of the first i letters from the first j
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      d[i][j] = i + j;
      if (i == 0 || j == 0) continue;
      const auto same = [&](std::size_t k, std::size_t l) { return lower(a[i - k]) == lower(b[j - l]); };
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (same(1, 1) ? 0 : 1)});
      if (i > 1 && j > 1 && same(1, 2) && same(2, 1)) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates) {
  if (word.empty() || word.size() > kLongestWord) return "";
  const std::size_t allowed = std::max<std::size_t>(1, word.size() / 3);
  std::size_t best = std::numeric_limits<std::size_t>::max();
  const std::string* nearest = nullptr;
  for (const std::string& candidate : candidates) {
    if (candidate.empty() || candidate.size() > kLongestWord) continue;
    const std::size_t a = word.size(), b = candidate.size();
    if (std::max(a, b) - std::min(a, b) > allowed) continue;  // the distance is at least that
    const std::size_t d = distance(word, candidate);
    if (d < best) {
      best = d;
      nearest = &candidate;
    }
  }
  // A one-letter name with a wrong letter is another name, and 'maximize' is the opposite of 'minimize'.
  const auto opposites = [](std::string_view a, std::string_view b) {
    return a.starts_with("max") && b.starts_with("min");
  };
  if (nearest != nullptr && (opposites(word, *nearest) || opposites(*nearest, word))) return "";
  if (nearest == nullptr || best > allowed || best >= std::max(word.size(), nearest->size())) return "";
  return " (did you mean '" + *nearest + "'?)";
}

std::string joined(const std::vector<std::string>& words) {
  std::string all;
  for (const std::string& word : words) {
    if (!all.empty()) all += ", ";
    all += word;
  }
  return all;
}

}  // namespace mbsopt
