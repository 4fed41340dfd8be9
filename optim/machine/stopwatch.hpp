// The time since its construction: wall time, or that of a given clock. A count of work makes runs repeatable.
#pragma once

#include <chrono>
#include <functional>
#include <utility>

namespace mbsopt::inline optim {

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

}  // namespace mbsopt::inline optim
