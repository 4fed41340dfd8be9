#include "optim/solver/search_watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace mbsopt {
namespace {

using Iterate = SearchWatch::Iterate;
using Iterates = std::deque<Iterate>;

// Returns the first of the last count + 1 iterates.
Iterates::const_iterator last(const Iterates& iterates, std::size_t count) {
  return iterates.size() > count + 1 ? iterates.end() - static_cast<std::ptrdiff_t>(count + 1) : iterates.begin();
}

std::pair<double, double> range_of_f(Iterates::const_iterator begin, Iterates::const_iterator end) {
  const auto by_f = [](const Iterate& a, const Iterate& b) { return a.f < b.f; };
  const auto [least, most] = std::minmax_element(begin, end, by_f);
  return {least->f, most->f};
}

}  // namespace

SearchEnd SearchWatch::look(const Iterate& iterate) {
  if (iterate.distance <= tolerance_) return SearchEnd::optimal;
  recent_.push_back(iterate);
  if (recent_.size() > kCreeping + 1) recent_.pop_front();
  if (is_stalled()) return SearchEnd::stalled;
  return unconstrained_ && is_creeping() ? SearchEnd::creeping : SearchEnd::none;
}

const Iterate& SearchWatch::most_stationary() const {
  return *std::min_element(last(recent_, kStalled), recent_.end(),
                           [](const Iterate& a, const Iterate& b) { return a.distance < b.distance; });
}

bool SearchWatch::is_stalled() const {
  constexpr double kNoise = 1e-2;  // times the tolerance, relative to f
  if (recent_.size() <= kStalled) return false;
  const auto [least, most] = range_of_f(last(recent_, kStalled), recent_.end());
  return most - least <= std::max(tolerance_ * tolerance_, kNoise * tolerance_ * std::abs(most));
}

bool SearchWatch::is_creeping() const {
  constexpr double kLittle = 0.01, kBeside = 0.1;
  if (recent_.size() <= kCreeping) return false;
  const bool far = std::all_of(recent_.begin(), recent_.end(), [&](const Iterate& i) { return i.distance > kBeside; });
  const auto [least, most] = range_of_f(recent_.begin(), recent_.end());
  return far && most - least <= kLittle * std::abs(most);
}

}  // namespace mbsopt
