// Ranges of values: a program evaluated with intervals instead of numbers (Moore, Kearfott, Cloud, "Introduction to
// Interval Analysis", SIAM 2009, chapter 5). For any x within the ranges of the inputs, each value of the program lies
// within its range. The range may be too wide, as of x - x, but shrinks to the value with the ranges of the inputs.
// Roundings are left out.
#pragma once

#include <span>
#include <vector>

#include "core/expression/program.hpp"

namespace mbsopt {

struct Range {
  double low = 0, high = 0;
  bool turns = false;  // of abs and smooth_abs: the operand passes through zero, by more than eps
};

// The range of each instruction's value, of the result last, for inputs within the ranges x.
void ranges_of(const Program& program, std::span<const Range> x, std::vector<Range>& range);

}  // namespace mbsopt
