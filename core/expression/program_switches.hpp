// Where the value of a program may jump: functions of its inputs, at whose zeros it may. Denominators, bases of powers,
// both arguments of atan2, the cosine of what tan is taken of, and what kinks, squares and the choices of derivatives
// depend on, since denominators may touch zero there. It need not jump (sin(x)/x); functions without inputs are left
// out, and all of them where nothing can jump.
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
