#include "core/integrate/replayer.hpp"

#include <algorithm>

namespace mbsopt {
namespace {

constexpr long kStretch = 256;  // steps at once: their list is copied

}  // namespace

bool Replayer::replay(const Snapshot& from, long last, const std::function<bool()>& dense,
                      const std::function<void(const Step&)>& sink, const std::function<bool()>& go_on) {
  if (!run_) run_.emplace(mechanism_, settings_, method_);
  const StepObserver observer = [&](const Step& step) {
    sink(step);
    return std::string();
  };
  Snapshot at = from;
  while (at.step < last) {
    if (!go_on()) return false;
    const long next = std::min(last, at.step + kStretch);
    StepSequence part;
    part.times.assign(steps_.times.begin() + at.step, steps_.times.begin() + next);
    part.sizes.assign(steps_.sizes.begin() + at.step, steps_.sizes.begin() + next);
    part.to_the_end = static_cast<std::size_t>(next) == steps_.times.size();
    SimulationResult result;
    RunOptions options;
    options.frozen = &part;
    run_->run(
        at.y0, at.angles, [&](double) { return dense(); }, {&observer, 1}, options, result);
    factorisations_ = result.statistics.factorisations;  // of all calls so far
    if (!result.ok()) return false;
    at = {next, result.y_end, run_->angles()};
  }
  return true;
}

}  // namespace mbsopt
