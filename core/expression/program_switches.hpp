// The switches of a program: functions of its inputs at whose zeros its value may jump. They are denominators, bases of
// powers, both arguments of atan2, and the cosine of the argument of tan. The arguments of kinks, squares and choices
// of derivatives are switches, too, since denominators may touch zero there. The value need not jump (sin(x)/x).
// Functions without inputs are left out. The list is empty if nothing can jump.
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

}  // namespace mbsopt
