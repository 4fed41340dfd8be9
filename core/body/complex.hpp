// Complex numbers are the vectors and turns of the plane: x = A s turns and scales s, A = P^2 for P = e0 + i e_n.
//
// T is double or LaneDual. A LaneDual is a number with its derivatives in kLanes directions, so every formula written
// for T is its own tangent. Products with a constant factor keep to plain numbers.
#pragma once

#include <cmath>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {

struct LaneDual {
  using Lane = Eigen::Array<double, 1, kLanes>;
  double v = 0;
  Lane d = Lane::Zero();

  LaneDual() = default;
  LaneDual(double value) : v(value) {}
  LaneDual(double value, const Lane& direction) : v(value), d(direction) {}
};

inline LaneDual operator+(const LaneDual& a, const LaneDual& b) { return {a.v + b.v, a.d + b.d}; }
inline LaneDual operator-(const LaneDual& a, const LaneDual& b) { return {a.v - b.v, a.d - b.d}; }
inline LaneDual operator-(const LaneDual& a) { return {-a.v, -a.d}; }
inline LaneDual operator*(const LaneDual& a, const LaneDual& b) { return {a.v * b.v, a.v * b.d + b.v * a.d}; }
inline LaneDual operator*(double a, const LaneDual& b) { return {a * b.v, a * b.d}; }
inline LaneDual operator*(const LaneDual& a, double b) { return b * a; }
inline LaneDual operator/(const LaneDual& a, const LaneDual& b) {
  const double v = a.v / b.v;
  return {v, (a.d - v * b.d) / b.v};
}
inline LaneDual sqrt(const LaneDual& a) {
  const double v = std::sqrt(a.v);
  return {v, a.d / (2 * v)};
}
inline LaneDual atan2(const LaneDual& y, const LaneDual& x) {
  return {std::atan2(y.v, x.v), (x.v * y.d - y.v * x.d) / (x.v * x.v + y.v * y.v)};
}
inline double value(double x) { return x; }
inline double value(const LaneDual& x) { return x.v; }

template <class T>
struct Complex {
  T re = 0, im = 0;
};
using Plane = Complex<double>;
using PlaneDual = Complex<LaneDual>;

template <class A, class B>
auto operator+(const Complex<A>& a, const Complex<B>& b) {
  return Complex<decltype(a.re * b.re)>{a.re + b.re, a.im + b.im};
}
template <class A, class B>
auto operator-(const Complex<A>& a, const Complex<B>& b) {
  return Complex<decltype(a.re * b.re)>{a.re - b.re, a.im - b.im};
}
template <class A>
Complex<A> operator-(const Complex<A>& a) {
  return {-a.re, -a.im};
}
template <class A, class B>
auto operator*(const Complex<A>& a, const Complex<B>& b) {
  return Complex<decltype(a.re * b.re)>{a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
template <class A>
Complex<A> operator*(double s, const Complex<A>& a) {
  return {s * a.re, s * a.im};
}
inline PlaneDual operator*(const LaneDual& s, const PlaneDual& a) { return {s * a.re, s * a.im}; }
inline PlaneDual operator*(const LaneDual& s, const Plane& a) { return {s * a.re, s * a.im}; }
template <class A, class B>
Complex<A>& operator+=(Complex<A>& a, const Complex<B>& b) {
  return a = a + b;
}
template <class A, class B>
Complex<A>& operator-=(Complex<A>& a, const Complex<B>& b) {
  return a = a - b;
}

template <class A>
Complex<A> conj(const Complex<A>& a) {
  return {a.re, -a.im};
}
template <class A>
Complex<A> times_i(const Complex<A>& a) {
  return {-a.im, a.re};
}
// a'b and the third component of a x b: the real and imaginary parts of conj(a) b.
template <class A, class B>
auto dot(const Complex<A>& a, const Complex<B>& b) {
  return decltype(a.re * b.re)(a.re * b.re + a.im * b.im);
}
template <class A, class B>
auto cross(const Complex<A>& a, const Complex<B>& b) {
  return decltype(a.re * b.re)(a.re * b.im - a.im * b.re);
}
template <class A>
A squared_norm(const Complex<A>& a) {
  return a.re * a.re + a.im * a.im;
}
template <class A>
Complex<A> inverse(const Complex<A>& a) {
  const A n = squared_norm(a);
  return {a.re / n, -a.im / n};
}

}  // namespace mbsopt
