// Declared times at which laws may jump or have kinks: a step ends there, and the next begins there.
//
// A stage at the end of a step must see the law before the event, and the first stage of the next step must see it
// after the event. At the event itself a law may have no value (abs(x)/x). So the step ends a few roundings early, and
// the next begins as many late, from the same state. The gap is 32 roundings of the time, 7e-15 of it, and nothing
// moves in it. Discrete derivatives treat it as part of the sequence of steps.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace mbsopt {

class EventTimes {
 public:
  EventTimes(const std::vector<double>& times, double start, double end)
      : times_(times),
        end_(end),
        gap_(16 * std::numeric_limits<double>::epsilon() * std::max(std::abs(start), std::abs(end))) {
    std::sort(times_.begin(), times_.end());
    std::erase_if(times_, [&](double t) { return t <= start + 2 * gap_ || t >= end - 2 * gap_; });
  }

  // The latest end of a step that begins at t.
  double stop_after(double t) {
    while (next_ < times_.size() && t >= times_[next_] - gap_) ++next_;
    return next_ < times_.size() ? times_[next_] - gap_ : end_;
  }
  // Returns whether a step that ends at t1 has reached the event of stop_after().
  bool reached(double t1) const { return next_ < times_.size() && t1 >= times_[next_] - 1.5 * gap_; }
  double resume_time() const { return times_[next_] + gap_; }

 private:
  std::vector<double> times_;
  std::size_t next_ = 0;
  double end_, gap_;
};

}  // namespace mbsopt
