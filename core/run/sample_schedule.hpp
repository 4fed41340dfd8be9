// Sample times of costs and observers in ascending order; finds those that lie in a step.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/run/cost.hpp"

namespace mbsopt {

struct SampleEvent {
  double time = 0;
  const PointCost* cost = nullptr;  // null: an observation
  Eigen::Index objective = 0;       // of a cost
  std::size_t index = 0;            // of an observation
};

class SampleSchedule {
 public:
  SampleSchedule(std::span<const Cost> costs, std::span<const double> observed, double end) : end_(end) {
    events_.reserve(observed.size());
    for (std::size_t o = 0; o < costs.size(); ++o) {
      for (const SampledCost& s : costs[o].samples) {
        events_.push_back({s.time, s.cost.get(), static_cast<Eigen::Index>(o), 0});
      }
    }
    for (std::size_t i = 0; i < observed.size(); ++i) events_.push_back({observed[i], nullptr, 0, i});
    const auto before = [](const SampleEvent& a, const SampleEvent& b) { return a.time < b.time; };
    if (!std::is_sorted(events_.begin(), events_.end(), before))  // records of a million rows are
      std::stable_sort(events_.begin(), events_.end(), before);
  }

  // The time of the next event; infinite if there is none.
  double next_time() const { return next_ < events_.size() ? events_[next_].time : INFINITY; }

  bool due(double t1) const { return next_ < events_.size() && (events_[next_].time <= t1 || t1 >= end_); }

  // Returns the events up to t1 that it has not returned before. The step that reaches the end takes all that remain.
  std::span<const SampleEvent> take(double t1) {
    const std::size_t first = next_;
    while (due(t1)) ++next_;
    return std::span<const SampleEvent>(events_).subspan(first, next_ - first);
  }

 private:
  std::vector<SampleEvent> events_;
  std::size_t next_ = 0;
  double end_;
};

}  // namespace mbsopt
