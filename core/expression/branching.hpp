// A place at which a program takes one of two branches (branches.hpp).
#pragma once

#include <cmath>

#include "core/expression/program.hpp"

namespace mbsopt {

struct Branching {
  std::size_t instruction = 0;
  double sample = 0;  // of a table
  Program decision;   // its inputs are those of the program
  int sign = 1;       // 1, or -1 where the branch follows the opposite sign
  // The exponent of a power or root that reads the branch and has no values on its other side; if it is below 2, its
  // second derivative is infinite there. `rises` is the side of the decision on which it varies; 0: on both.
  double root = INFINITY;
  int rises = 0;
};

}  // namespace mbsopt
