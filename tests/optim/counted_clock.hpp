// A clock that only looks at it move, by 50 us each: runs look once per step, so budgets and limits become counts of
// steps, and what is measured within them is the same on any machine, however busy.
#pragma once

#include "optim/machine/stopwatch.hpp"

namespace mbsopt {

class CountedClock {
 public:
  CountedClock() = default;
  CountedClock(const CountedClock&) = delete;
  CountedClock& operator=(const CountedClock&) = delete;

  Clock clock() {
    return [this] { return kPerLook * static_cast<double>(++looks_); };
  }

 private:
  static constexpr double kPerLook = 5e-5;  // [s]: about what a step of a small mechanism takes
  long looks_ = 0;
};

}  // namespace mbsopt
