// The operations an expression is made of: value, first and second partial derivatives. The one place where the
// calculus of expressions is written; the parser, the folding of constants and every sweep of a Program use this table.
//
// Derivatives are exact wherever they exist. Where they do not exist:
//   abs at 0                    0 (the middle of its subdifferential)
//   min, max of equal operands  those of the first operand
//   sqrt at 0                   infinite
#pragma once

#include <string_view>

namespace mbsopt {

enum class Operation : unsigned char {
  number,  // a constant
  name,    // a free name; in a Program: an input
  negate,
  add,
  subtract,
  multiply,
  divide,
  power,
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  atan2,
  sinh,
  cosh,
  tanh,
  exp,
  log,
  sqrt,
  abs,
  min,
  max,
  smooth_abs,  // sqrt(a^2 + b^2)
};

// 0 for number and name, else 1 or 2.
int operands(Operation operation);

double apply(Operation operation, double a, double b);

// Partial derivatives of f(a, b), with value = apply(operation, a, b).
struct FirstPartials {
  double a = 0, b = 0;
};
struct SecondPartials {
  double aa = 0, ab = 0, bb = 0;
};
FirstPartials first_partials(Operation operation, double a, double b, double value);
SecondPartials second_partials(Operation operation, double a, double b, double value);

// Functions as users call them.
//   smooth_abs(x, eps)    = sqrt(x^2 + eps^2)                          eps: 1e-6 unless given
//   smooth_max(a, b, eps) = (a + b + smooth_abs(a - b, eps)) / 2
// min and max take two or more arguments.
struct FunctionEntry {
  std::string_view name;
  Operation operation;  // of smooth_max: smooth_abs, since it is written with it
  int least, most;      // number of arguments; most = -1: any number
};
const FunctionEntry* find_function(std::string_view name);  // nullptr when there is none

inline constexpr double kSmoothingDefault = 1e-6;

inline constexpr FunctionEntry kFunctions[] = {
    {"sin", Operation::sin, 1, 1},
    {"cos", Operation::cos, 1, 1},
    {"tan", Operation::tan, 1, 1},
    {"asin", Operation::asin, 1, 1},
    {"acos", Operation::acos, 1, 1},
    {"atan", Operation::atan, 1, 1},
    {"atan2", Operation::atan2, 2, 2},
    {"sinh", Operation::sinh, 1, 1},
    {"cosh", Operation::cosh, 1, 1},
    {"tanh", Operation::tanh, 1, 1},
    {"exp", Operation::exp, 1, 1},
    {"log", Operation::log, 1, 1},
    {"sqrt", Operation::sqrt, 1, 1},
    {"abs", Operation::abs, 1, 1},
    {"min", Operation::min, 2, -1},
    {"max", Operation::max, 2, -1},
    {"smooth_abs", Operation::smooth_abs, 1, 2},
    {"smooth_max", Operation::smooth_abs, 2, 3},
};

}  // namespace mbsopt
