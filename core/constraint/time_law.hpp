// The law f(t, rho) of a row's sum of primitives, with f_t and f_tt and the derivatives of all three in the parameters.
// It is a constant (the length of a rod) or an expression in t and parameters.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>

#include "core/expression/program.hpp"

namespace mbsopt {

struct TimeLaw {
  double constant = 0;
  int slot = -1;                                           // row of the constant among the differentiated fields
  std::shared_ptr<const std::array<Program, 3>> programs;  // f, f_t, f_tt; inputs: all parameters, then t
  bool smooth = false;                                     // a spline through samples, which needs no search for jumps

  using Jet = std::array<double, 3>;  // f, f_t, f_tt
  // inputs: all parameters, then t
  Jet at(const std::vector<double>& inputs, Program::Scratch& scratch) const {
    if (!programs) return {constant, 0, 0};
    return {(*programs)[0].value(inputs, scratch), (*programs)[1].value(inputs, scratch),
            (*programs)[2].value(inputs, scratch)};
  }
};

}  // namespace mbsopt
