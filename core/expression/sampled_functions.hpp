// The functions through samples in a program (table(), spline(), signals and their derivatives). Each comes with the
// program of its argument, which has the same inputs.
//
//   for (const SampledFunction& f : sampled_functions_of(law)) f.curve->at(f.argument.value(inputs, scratch), f.order);
#pragma once

#include <memory>
#include <vector>

#include "core/expression/program.hpp"

namespace mbsopt {

struct SampledFunction {
  std::shared_ptr<const Curve> curve;
  int order = 0;  // of the derivative
  Program argument;
};

std::vector<SampledFunction> sampled_functions_of(const Program& program);

}  // namespace mbsopt
