// Complex numbers are the vectors and turns of the plane: x = A s turns and scales s, A = P^2 for P = e0 + i e_n.
//
// T is double or Dual, so every formula written for T is its own tangent. Products with a constant factor keep to plain
// numbers.
#pragma once

#include <cmath>
#include <type_traits>

#include "core/linear/dual_numbers.hpp"

namespace mbsopt {

template <class T>
struct Complex {
  T re = 0, im = 0;
};
using Plane = Complex<double>;
using PlaneDual = Complex<Dual>;
template <class A, class B>
using ProductOf = std::conditional_t<std::is_same_v<A, B>, A, Dual>;

template <class A, class B>
auto operator+(const Complex<A>& a, const Complex<B>& b) {
  return Complex<ProductOf<A, B>>{a.re + b.re, a.im + b.im};
}
template <class A, class B>
auto operator-(const Complex<A>& a, const Complex<B>& b) {
  return Complex<ProductOf<A, B>>{a.re - b.re, a.im - b.im};
}
template <class A>
Complex<A> operator-(const Complex<A>& a) {
  return {-a.re, -a.im};
}
template <class A, class B>
auto operator*(const Complex<A>& a, const Complex<B>& b) {
  return Complex<ProductOf<A, B>>{a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
template <class A>
Complex<A> operator*(double s, const Complex<A>& a) {
  return {s * a.re, s * a.im};
}
inline PlaneDual operator*(const Dual& s, const PlaneDual& a) { return {s * a.re, s * a.im}; }
inline PlaneDual operator*(const Dual& s, const Plane& a) { return {s * a.re, s * a.im}; }
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
  return ProductOf<A, B>(a.re * b.re + a.im * b.im);
}
template <class A, class B>
auto cross(const Complex<A>& a, const Complex<B>& b) {
  return ProductOf<A, B>(a.re * b.im - a.im * b.re);
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
