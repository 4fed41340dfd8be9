// Time since it was made: wall time, unless it is given a clock (a count of work, for runs that are to be repeatable).
#pragma once

#include <chrono>
#include <functional>
#include <utility>

namespace mbsopt {

using Clock = std::function<double()>;  // [s]; empty: wall time

class Stopwatch {
 public:
  explicit Stopwatch(Clock clock = {}) : clock_(std::move(clock)), start_(now()) {}
  double seconds() const { return now() - start_; }

 private:
  double now() const {
    if (clock_) return clock_();
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  Clock clock_;
  double start_;
};

}  // namespace mbsopt
