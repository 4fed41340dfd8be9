// The operations of an expression: value, first and second partial derivatives. The calculus of expressions is written
// only here. The parser, the folding of constants and every sweep of a Program use this table.
//
// Derivatives are exact wherever they exist. Elsewhere:
//   abs at 0                    0 (the middle of its subdifferential)
//   min, max of equal operands  those of the first operand
//   sqrt at 0                   infinite
#pragma once

#include <cassert>
#include <cmath>
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
  sign,        // -1, 0 or 1: the derivative of abs; only derivative programs use it
  not_above,   // 1 where a <= b, else 0: the choice of min and max; only derivative programs use it
  curve,       // a function through samples (curve.hpp) of a; the owner of the curve evaluates it
};

// 0 for number and name, else 1 or 2.
int operands(Operation operation);

inline double apply(Operation operation, double a, double b);

// Partial derivatives of f(a, b), with value = apply(operation, a, b).
struct FirstPartials {
  double a = 0, b = 0;
};
struct SecondPartials {
  double aa = 0, ab = 0, bb = 0;
};
inline FirstPartials first_partials(Operation operation, double a, double b, double value);
inline SecondPartials second_partials(Operation operation, double a, double b, double value);

// Functions in the form that users call.
//   smooth_abs(x, eps)    = sqrt(x^2 + eps^2)                          eps: 1e-6 unless given
//   smooth_max(a, b, eps) = (a + b + smooth_abs(a - b, eps)) / 2
//   spline(x, [x0, ...], [y0, ...]), table(x, [x0, ...], [y0, ...])    y may hold expressions
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
    {"spline", Operation::curve, 3, 3},
    {"table", Operation::curve, 3, 3},
};

// This is inline because a Program spends its time here.

inline double apply(Operation operation, double a, double b) {
  switch (operation) {
    case Operation::number:
    case Operation::name:
    case Operation::curve:
      break;
    case Operation::negate:
      return -a;
    case Operation::add:
      return a + b;
    case Operation::subtract:
      return a - b;
    case Operation::multiply:
      return a * b;
    case Operation::divide:
      return a / b;
    case Operation::power:
      return std::pow(a, b);
    case Operation::sin:
      return std::sin(a);
    case Operation::cos:
      return std::cos(a);
    case Operation::tan:
      return std::tan(a);
    case Operation::asin:
      return std::asin(a);
    case Operation::acos:
      return std::acos(a);
    case Operation::atan:
      return std::atan(a);
    case Operation::atan2:
      return std::atan2(a, b);
    case Operation::sinh:
      return std::sinh(a);
    case Operation::cosh:
      return std::cosh(a);
    case Operation::tanh:
      return std::tanh(a);
    case Operation::exp:
      return std::exp(a);
    case Operation::log:
      return std::log(a);
    case Operation::sqrt:
      return std::sqrt(a);
    case Operation::abs:
      return std::abs(a);
    case Operation::min:
      return (a <= b || std::isnan(a)) ? a : b;  // NaN of either operand passes through
    case Operation::max:
      return (a >= b || std::isnan(a)) ? a : b;
    case Operation::smooth_abs:
      return std::hypot(a, b);
    case Operation::sign:
      return a > 0 ? 1 : (a < 0 ? -1 : 0);
    case Operation::not_above:
      return a <= b ? 1 : 0;
  }
  assert(false && "a leaf or a curve");
  return 0;
}

namespace calculus {

// a^b. Zero factors win over infinite ones: b a^(b-1) is 0 for b = 0 whatever a, and a^b log a is 0 at a = 0 < b.
inline double power_a(double a, double b) { return b == 0 ? 0 : b * std::pow(a, b - 1); }
inline double power_aa(double a, double b) { return b == 0 || b == 1 ? 0 : b * (b - 1) * std::pow(a, b - 2); }
inline double power_b(double a, double b, double value) { return a == 0 && b > 0 ? 0 : value * std::log(a); }
inline double power_bb(double a, double b, double value) {
  return a == 0 && b > 0 ? 0 : value * std::log(a) * std::log(a);
}
inline double power_ab(double a, double b) {  // a^(b-1) (1 + b log a)
  return a == 0 && b > 1 ? 0 : std::pow(a, b - 1) * (1 + b * std::log(a));
}
inline double cosine_of_asin(double a) { return std::sqrt((1 - a) * (1 + a)); }

}  // namespace calculus

inline FirstPartials first_partials(Operation operation, double a, double b, double value) {
  switch (operation) {
    case Operation::number:
    case Operation::name:
    case Operation::curve:
      break;
    case Operation::negate:
      return {-1, 0};
    case Operation::add:
      return {1, 1};
    case Operation::subtract:
      return {1, -1};
    case Operation::multiply:
      return {b, a};
    case Operation::divide:
      return {1 / b, -value / b};
    case Operation::power:
      return {calculus::power_a(a, b), calculus::power_b(a, b, value)};
    case Operation::sin:
      return {std::cos(a), 0};
    case Operation::cos:
      return {-std::sin(a), 0};
    case Operation::tan:
      return {1 + value * value, 0};
    case Operation::asin:
      return {1 / calculus::cosine_of_asin(a), 0};
    case Operation::acos:
      return {-1 / calculus::cosine_of_asin(a), 0};
    case Operation::atan:
      return {1 / (1 + a * a), 0};
    case Operation::atan2: {
      const double r = std::hypot(a, b);
      return {b / r / r, -a / r / r};
    }
    case Operation::sinh:
      return {std::cosh(a), 0};
    case Operation::cosh:
      return {std::sinh(a), 0};
    case Operation::tanh: {
      const double c = std::cosh(a);
      return {1 / c / c, 0};
    }
    case Operation::exp:
      return {value, 0};
    case Operation::log:
      return {1 / a, 0};
    case Operation::sqrt:
      return {0.5 / value, 0};
    case Operation::abs:
      return {a > 0 ? 1.0 : (a < 0 ? -1.0 : 0.0), 0};
    case Operation::min:
      return a <= b ? FirstPartials{1, 0} : FirstPartials{0, 1};
    case Operation::max:
      return a >= b ? FirstPartials{1, 0} : FirstPartials{0, 1};
    case Operation::smooth_abs:
      return value == 0 ? FirstPartials{0, 0} : FirstPartials{a / value, b / value};
    case Operation::sign:
    case Operation::not_above:
      return {};
  }
  assert(false && "a leaf or a curve");
  return {};
}

inline SecondPartials second_partials(Operation operation, double a, double b, double value) {
  switch (operation) {
    case Operation::number:
    case Operation::name:
    case Operation::curve:
      break;
    case Operation::negate:
    case Operation::add:
    case Operation::subtract:
    case Operation::abs:
    case Operation::min:
    case Operation::max:
    case Operation::sign:
    case Operation::not_above:
      return {};
    case Operation::multiply:
      return {0, 1, 0};
    case Operation::divide:
      return {0, -1 / b / b, 2 * value / b / b};
    case Operation::power:
      return {calculus::power_aa(a, b), calculus::power_ab(a, b), calculus::power_bb(a, b, value)};
    case Operation::sin:
      return {-value, 0, 0};
    case Operation::cos:
      return {-value, 0, 0};
    case Operation::tan:
      return {2 * value * (1 + value * value), 0, 0};
    case Operation::asin: {
      const double c = calculus::cosine_of_asin(a);
      return {a / c / c / c, 0, 0};
    }
    case Operation::acos: {
      const double c = calculus::cosine_of_asin(a);
      return {-a / c / c / c, 0, 0};
    }
    case Operation::atan: {
      const double d = 1 + a * a;
      return {-2 * a / d / d, 0, 0};
    }
    case Operation::atan2: {
      const double r = std::hypot(a, b), s = a / r, c = b / r;
      return {-2 * s * c / r / r, (s - c) * (s + c) / r / r, 2 * s * c / r / r};
    }
    case Operation::sinh:
      return {value, 0, 0};
    case Operation::cosh:
      return {value, 0, 0};
    case Operation::tanh: {
      const double c = std::cosh(a);
      return {-2 * value / c / c, 0, 0};
    }
    case Operation::exp:
      return {value, 0, 0};
    case Operation::log:
      return {-1 / a / a, 0, 0};
    case Operation::sqrt:
      return {-0.25 / value / a, 0, 0};
    case Operation::smooth_abs: {
      if (value == 0) return {};
      const double c = a / value, s = b / value;
      return {s * s / value, -s * c / value, c * c / value};
    }
  }
  assert(false && "a leaf or a curve");
  return {};
}

}  // namespace mbsopt
