// The operations of an expression: their values and partial derivatives. The calculus of expressions is written only
// here. The parser, the folding of constants, every sweep of a Program and its derivative programs use these tables.
//
// partials() is a template in its number T, so one table serves three purposes:
//   double   the derivatives of a sweep
//   Tangent  the same with their directional derivative, which is what second derivatives are needed for
//   Term     instructions that compute them (program_builder.hpp): a derivative as a program of its own
//
// Derivatives are exact wherever they exist. Elsewhere:
//   abs at 0                    0 (the middle of its subdifferential)
//   min, max of equal operands  those of the first operand
//   sqrt at 0                   infinite
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <string_view>

namespace mbsopt {

enum class Operation : unsigned char {
  number,  // a constant
  name,    // a free name; in a Program: an input
  // These take two operands:
  add,
  subtract,
  multiply,
  divide,
  power,
  atan2,
  min,
  max,
  smooth_abs,  // sqrt(a^2 + b^2)
  not_above,   // 1 where a <= b, else 0: the choice of min and max; only derivative programs use it
  // These take one operand:
  negate,
  abs,
  sign,  // -1, 0 or 1: the derivative of abs; only derivative programs use it
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  sinh,
  cosh,
  tanh,
  exp,
  log,
  sqrt,
  curve,  // a function through samples (curve.hpp) of a; the owner of the curve evaluates it
};

constexpr int operands(Operation f) { return f <= Operation::name ? 0 : f <= Operation::not_above ? 2 : 1; }

// Partial derivatives of f(a, b).
template <class T>
struct Partials {
  T a, b;
};

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

inline const FunctionEntry* find_function(std::string_view name) {  // nullptr when there is none
  const auto* const entry = std::ranges::find(kFunctions, name, &FunctionEntry::name);
  return entry == std::end(kFunctions) ? nullptr : entry;
}

inline constexpr double (*kOfOne[])(double) = {  // sin and those after it
    std::sin,  std::cos,  std::tan,  std::asin, std::acos, std::atan,
    std::sinh, std::cosh, std::tanh, std::exp,  std::log,  std::sqrt};

// This is inline because a Program spends its time here.
inline double apply(Operation operation, double a, double b) {
  switch (operation) {
    case Operation::negate:
      return -a;
    case Operation::abs:
      return std::abs(a);
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
    case Operation::atan2:
      return std::atan2(a, b);
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
    default:
      assert(operation >= Operation::sin && operation < Operation::curve);
      return kOfOne[static_cast<int>(operation) - static_cast<int>(Operation::sin)](a);
  }
}

// The functions of a number T that partials() needs; T::of(operation, a, b) evaluates an operation.
template <class T>
struct Arithmetic {
  friend T operator+(const T& a, const T& b) { return T::of(Operation::add, a, b); }
  friend T operator-(const T& a, const T& b) { return T::of(Operation::subtract, a, b); }
  friend T operator*(const T& a, const T& b) { return T::of(Operation::multiply, a, b); }
  friend T operator/(const T& a, const T& b) { return T::of(Operation::divide, a, b); }
  friend T operator-(const T& a) { return T::of(Operation::negate, a, a); }
  friend T pow(const T& a, const T& b) { return T::of(Operation::power, a, b); }
  friend T hypot(const T& a, const T& b) { return T::of(Operation::smooth_abs, a, b); }
  friend T not_above(const T& a, const T& b) { return T::of(Operation::not_above, a, b); }
  friend T sin(const T& a) { return T::of(Operation::sin, a, a); }
  friend T cos(const T& a) { return T::of(Operation::cos, a, a); }
  friend T sinh(const T& a) { return T::of(Operation::sinh, a, a); }
  friend T cosh(const T& a) { return T::of(Operation::cosh, a, a); }
  friend T log(const T& a) { return T::of(Operation::log, a, a); }
  friend T sqrt(const T& a) { return T::of(Operation::sqrt, a, a); }
  friend T sign(const T& a) { return T::of(Operation::sign, a, a); }
};

namespace calculus {

inline double sign(double a) { return apply(Operation::sign, a, 0); }
inline double not_above(double a, double b) { return apply(Operation::not_above, a, b); }
inline double constant(double x, double) { return x; }  // x as a number of the type of the second argument
inline double product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }  // zero wins over an infinite factor
inline double seeded(double seed, double factor) { return seed == 0 ? 0 : seed * factor; }  // but inf * 0 is NaN
inline double quotient(double a, double b) { return b == 0 ? 0 : a / b; }  // 0 where the denominator is

}  // namespace calculus

// value = apply(operation, a, b). A power a^b has b a^(b-1) = 0 for b = 0 whatever a, and a^b log a = 0 at a = 0 < b.
template <class T>
Partials<T> partials(Operation operation, const T& a, const T& b, const T& value) {
  using calculus::constant, calculus::not_above, calculus::product, calculus::quotient, calculus::sign;
  using std::cos, std::cosh, std::hypot, std::log, std::pow, std::sin, std::sinh, std::sqrt;
  const T zero = constant(0, a), one = constant(1, a);
  switch (operation) {
    case Operation::number:
    case Operation::name:
    case Operation::curve:
      break;
    case Operation::sign:
    case Operation::not_above:
      return {zero, zero};
    case Operation::negate:
      return {-one, zero};
    case Operation::add:
      return {one, one};
    case Operation::subtract:
      return {one, -one};
    case Operation::multiply:
      return {b, a};
    case Operation::divide:
      return {one / b, -(value / b)};
    case Operation::power:
      return {product(b, pow(a, b - one)), product(value, log(a))};
    case Operation::sin:
      return {cos(a), zero};
    case Operation::cos:
      return {-sin(a), zero};
    case Operation::tan:
      return {one + value * value, zero};
    case Operation::asin:
      return {one / sqrt((one - a) * (one + a)), zero};
    case Operation::acos:
      return {-(one / sqrt((one - a) * (one + a))), zero};
    case Operation::atan:
      return {one / (one + a * a), zero};
    case Operation::atan2: {
      const T r = hypot(a, b);
      return {b / r / r, -(a / r / r)};
    }
    case Operation::sinh:
      return {cosh(a), zero};
    case Operation::cosh:
      return {sinh(a), zero};
    case Operation::tanh:  // 1/cosh^2, whose own derivative would be inf/inf far out
      return {(one - value) * (one + value), zero};
    case Operation::exp:
      return {value, zero};
    case Operation::log:
      return {one / a, zero};
    case Operation::sqrt:
      return {constant(0.5, a) / value, zero};
    case Operation::abs:
      return {sign(a), zero};
    case Operation::min: {
      const T first = not_above(a, b);
      return {first, one - first};
    }
    case Operation::max: {
      const T first = not_above(b, a);
      return {first, one - first};
    }
    case Operation::smooth_abs:
      return {quotient(a, value), quotient(b, value)};
  }
  assert(false && "a leaf or a curve");
  return {zero, zero};
}

// A number with its derivative in one direction. Zero directions stay zero for every factor, also an infinite one:
// values that do not reach the result do not disturb its derivative.
struct Tangent : Arithmetic<Tangent> {
  double x = 0, dx = 0;

  explicit Tangent(double value = 0, double direction = 0) : x(value), dx(direction) {}
  static Tangent of(Operation operation, const Tangent& a, const Tangent& b) {
    const double value = apply(operation, a.x, b.x);
    const Partials<double> f = partials(operation, a.x, b.x, value);
    return Tangent(value, calculus::seeded(a.dx, f.a) + calculus::seeded(b.dx, f.b));
  }
  Tangent& operator+=(const Tangent& a) { return *this = Tangent(x + a.x, dx + a.dx); }
  bool operator==(const Tangent& a) const { return x == a.x && dx == a.dx; }
  friend Tangent constant(double number, const Tangent&) { return Tangent(number); }
  friend Tangent product(const Tangent& a, const Tangent& b) {
    using calculus::product;
    return Tangent(product(a.x, b.x), product(a.dx, b.x) + product(a.x, b.dx));
  }
  friend Tangent seeded(const Tangent& seed, const Tangent& factor) {
    using calculus::seeded;
    return Tangent(seeded(seed.x, factor.x), seeded(seed.dx, factor.x) + seeded(seed.x, factor.dx));
  }
  friend Tangent quotient(const Tangent& a, const Tangent& b) { return b.x == 0 ? Tangent() : a / b; }
};

}  // namespace mbsopt
