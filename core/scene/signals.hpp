// Signals of a scene as expressions of time and parameters, so that every law uses them by name:
//   signal(t) = gain f(t - delay) + offset        f: through the samples of its file
// The calculus of expressions also differentiates signals: in time, and in the parameters of gain, delay and offset.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/expression/program.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {

// f(t), the samples alone; 0 if no reader has filled them in.
Expression expression_of(const SampleColumn& samples, const std::string& name);
Expression expression_of(const Signal& signal);

// Adds all signals as definitions, which need an input "t".
void add_signals(Symbols& symbols, const Scene& scene);

// The first sample that differs from the one before by about a turn, and by much more than usual; 0 if there is none.
std::size_t first_wrap(const std::vector<double>& values, double turn);

// The span of time that samples cover, shifted by delay. The last value of hold counts for one more interval.  [s]
struct Covered {
  double first = 0, last = 0;
};
Covered covered_by(const Curve& samples, double delay = 0);
// The reason why samples do not cover the run, in words.
std::optional<std::string> uncovered(const Covered& samples, double start_time, double end_time);

}  // namespace mbsopt
