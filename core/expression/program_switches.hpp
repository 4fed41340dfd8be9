// The switches of a program: functions of its inputs at whose zeros its value or slope may jump. They are denominators,
// bases of powers, arguments of atan2, the cosine of the argument of tan, and arguments of kinks (abs, min, max,
// corners of tables) and sharp turns (tanh, atan, smooth_abs). Squares and choices of derivatives are, too, if
// denominators may touch zero there. Neither need jump (sin(x)/x). Functions without inputs are left out.
//
//   for (const Program& s : switches_of(law)) s.value(inputs, scratch);   // abs(t - tp)/(t - tp): t - tp
#pragma once

#include <vector>

#include "core/expression/program.hpp"

namespace mbsopt {

std::vector<Program> switches_of(const Program& program);

// A program and its switches, which are compiled once for all runs.
struct SwitchedProgram {
  Program program;
  std::vector<Program> switches;  // switches_of(program)
};

// A function through samples in a program (table(), spline(), signals and their derivatives), and the program of its
// argument, which has the same inputs:  f.use.curve->at(f.argument.value(inputs, scratch), f.use.order)
struct SampledFunction {
  Program::CurveUse use;
  Program argument;
};
std::vector<SampledFunction> sampled_functions_of(const Program& program);

}  // namespace mbsopt
