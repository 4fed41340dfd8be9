#include "optim/solver/search_watch.hpp"

#include <catch2/catch.hpp>

#include "tests/optim/small_programs.hpp"

using namespace mbsopt;
using mbsopt::testing::vector;

namespace {

constexpr double kTolerance = 1e-6;

// How many looks until the watch ends a search, of at most 100; f and distance by the number of the iterate.
template <class F, class Distance>
std::pair<int, SearchEnd> first_end(SearchWatch& watch, const F& f, const Distance& distance) {
  for (int k = 0; k < 100; ++k) {
    const SearchEnd end = watch.look({vector({double(k)}), f(k), distance(k)});
    if (end != SearchEnd::none) return {k, end};
  }
  return {100, SearchEnd::none};
}

const auto far = [](int) { return 1.0; };

}  // namespace

TEST_CASE("a search is optimal where an iterate is stationary to the tolerance", "[search_watch]") {
  SearchWatch watch(kTolerance, true);
  const auto falling = [](int k) { return 100.0 - k; };
  const auto [k, end] = first_end(watch, falling, [](int i) { return i == 7 ? 0.9e-6 : 1.1e-6; });
  CHECK(end == SearchEnd::optimal);
  CHECK(k == 7);
}

TEST_CASE("a search stalls where ten iterations change f by noise, and knows the most stationary of them",
          "[search_watch]") {
  SearchWatch watch(kTolerance, GENERATE(false, true));
  // Falls until 5, then by less than 1e-2 of the tolerance; the nearest of all is before that.
  const auto f = [](int k) { return k < 5 ? 10.0 - k : 5 + 1e-10 * k; };
  const auto distance = [](int k) { return k == 2 ? 1e-5 : k == 9 ? 1e-4 : 1e-3; };
  const auto [k, end] = first_end(watch, f, distance);
  CHECK(end == SearchEnd::stalled);
  CHECK(k == 5 + SearchWatch::kStalled);
  CHECK(watch.most_stationary().x(0) == 9);
}

TEST_CASE("a search creeps that gains less than 1 % in 20 iterations, far from stationary", "[search_watch]") {
  SearchWatch watch(kTolerance, true);
  const auto slow = [](int k) { return k < 5 ? 20.0 - k : 15 - 0.007 * (k - 5); };  // 0.14 in 20
  const auto [k, end] = first_end(watch, slow, far);
  CHECK(end == SearchEnd::creeping);
  CHECK(k == 5 + SearchWatch::kCreeping);
  SearchWatch faster(kTolerance, true);
  CHECK(first_end(
            faster, [](int i) { return 15 - 0.008 * i; }, far)
            .second == SearchEnd::none);
  SearchWatch nearer(kTolerance, true);  // as on the last metres of a valley
  CHECK(first_end(nearer, slow, [](int i) { return i % 15 == 0 ? 0.05 : 1.0; }).second == SearchEnd::none);
  SearchWatch constrained(kTolerance, false);
  CHECK(first_end(constrained, slow, far).second == SearchEnd::none);
}
