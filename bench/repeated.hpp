// Time of something short: the median over rounds, each long enough for the clock. Processor time of the calling
// thread, so that what else the machine does counts only by the caches it takes.
#pragma once

#include <time.h>

#include <algorithm>
#include <vector>

#include "optim/machine/median.hpp"

namespace mbsopt::bench {

class ThreadClock {
 public:
  double seconds() const { return now() - start_; }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }
  double start_ = now();
};

template <class F>
double seconds_of(F&& f, long count) {
  const ThreadClock clock;
  for (long i = 0; i < count; ++i) f();
  return clock.seconds() / static_cast<double>(count);
}

// How often f() has to run for a round of about `seconds`.
template <class F>
long repetitions(F&& f, double seconds = 5e-3) {
  for (long count = 1;; count *= 4) {
    const double one = seconds_of(f, count);
    if (one * static_cast<double>(count) > seconds / 4) return std::max(1L, static_cast<long>(seconds / one));
  }
}

template <class F>
double median_seconds(F&& f, int rounds = 15) {
  const long count = repetitions(f);
  std::vector<double> seconds;
  for (int i = 0; i < rounds; ++i) seconds.push_back(seconds_of(f, count));
  return median(std::move(seconds));
}

}  // namespace mbsopt::bench
