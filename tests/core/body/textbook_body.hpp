// The mechanics of one body written a second time, for any scalar, straight from the definitions: a rotation quadratic
// in p, time derivatives by truncated power series, gradients by the complex step (exact to rounding). What the product
// derives by hand is checked against it; nothing of the product is used here.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <random>
#include <vector>

namespace mbsopt::testing {

using Complex = std::complex<double>;

// Largest entry of x - y; NaN where one is.
template <class X, class Y>
double distance(const X& x, const Y& y) {
  return (x - y).cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
}

// c0 + c1 t + c2 t^2 + O(t^3)
template <class T>
struct Series {
  std::array<T, 3> c{};
  Series() = default;
  Series(const T& c0, const T& c1 = T(0), const T& c2 = T(0)) : c{c0, c1, c2} {}
  friend Series operator+(const Series& a, const Series& b) {
    return {a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2]};
  }
  friend Series operator-(const Series& a, const Series& b) {
    return {a.c[0] - b.c[0], a.c[1] - b.c[1], a.c[2] - b.c[2]};
  }
  friend Series operator*(const Series& a, const Series& b) {
    return {a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0], a.c[0] * b.c[2] + a.c[1] * b.c[1] + a.c[2] * b.c[0]};
  }
};

template <class T>
Series<T> sqrt(const Series<T>& a) {
  using std::sqrt;
  const T r = sqrt(a.c[0]), r1 = a.c[1] / (T(2) * r);
  return {r, r1, (a.c[2] - r1 * r1) / (T(2) * r)};
}
// Exact to first order in the imaginary parts, which is all that the complex step uses.
inline Complex atan2(const Complex& S, const Complex& C) {
  const double s = S.real(), c = C.real();
  return {std::atan2(s, c), (c * S.imag() - s * C.imag()) / (c * c + s * s)};
}
// The angle's rate is N/D with N = C Sdot - S Cdot, D = C^2 + S^2.
template <class T>
Series<T> atan2(const Series<T>& S, const Series<T>& C) {
  using mbsopt::testing::atan2;
  using std::atan2;  // beside the one above, which argument-dependent lookup does not find
  const T N0 = C.c[0] * S.c[1] - S.c[0] * C.c[1], N1 = T(2) * (C.c[0] * S.c[2] - S.c[0] * C.c[2]);
  const T D0 = C.c[0] * C.c[0] + S.c[0] * S.c[0], D1 = T(2) * (C.c[0] * C.c[1] + S.c[0] * S.c[1]);
  return {atan2(S.c[0], C.c[0]), N0 / D0, T(0.5) * (N1 - N0 * D1 / D0) / D0};
}

template <class T>
using V3 = std::array<T, 3>;
template <class T>
using V4 = std::array<T, 4>;
template <class T>
using M3 = std::array<V3<T>, 3>;  // rows

template <class T>
V3<T> operator+(const V3<T>& a, const V3<T>& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
template <class T>
V3<T> operator-(const V3<T>& a, const V3<T>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
template <class T>
T dot(const V3<T>& a, const V3<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class T>
V3<T> cross(const V3<T>& a, const V3<T>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
template <class T>
V3<T> scaled(const T& x, const V3<T>& a) {
  return {x * a[0], x * a[1], x * a[2]};
}
template <class T>
V3<T> times(const M3<T>& M, const V3<T>& a) {
  return {dot(M[0], a), dot(M[1], a), dot(M[2], a)};
}
template <class T>
V3<T> transposed_times(const M3<T>& M, const V3<T>& a) {
  return scaled(a[0], M[0]) + scaled(a[1], M[1]) + scaled(a[2], M[2]);
}
template <class T>
T norm(const V3<T>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}

// Euler-Rodrigues, homogeneous in p.
template <class T>
M3<T> rotation(const V4<T>& p) {
  const T two(2.0);
  const T &a = p[0], &b = p[1], &c = p[2], &d = p[3];
  return {V3<T>{a * a + b * b - c * c - d * d, two * (b * c - a * d), two * (b * d + a * c)},
          V3<T>{two * (b * c + a * d), a * a - b * b + c * c - d * d, two * (c * d - a * b)},
          V3<T>{two * (b * d - a * c), two * (c * d + a * b), a * a - b * b - c * c + d * d}};
}

template <class T>
struct TextbookFrame {
  V3<T> r;
  M3<T> A;
  V4<T> p;
  V3<T> point(const V3<T>& s) const { return r + times(A, s); }
};

// State of a body, with its acceleration z = (rddot, omegadot in body axes) and a virtual displacement eta.
template <class T>
struct TextbookBody {
  std::array<T, 7> q, v;
  std::array<double, 6> z{}, eta{};

  V4<T> p() const { return {q[3], q[4], q[5], q[6]}; }
  V4<T> pdot() const { return {v[3], v[4], v[5], v[6]}; }
  TextbookFrame<T> frame() const { return {{q[0], q[1], q[2]}, rotation<T>(p()), p()}; }

  // Along its motion: coefficients of t are velocities, those of t^2 half the accelerations.
  // 2 pddot = p * (0, omegadot) - 2 (pdot'pdot) p, a quaternion product
  TextbookFrame<Series<T>> moving() const {
    const V4<T> x = p(), w = pdot();
    const T spin = w[0] * w[0] + w[1] * w[1] + w[2] * w[2] + w[3] * w[3];
    const V3<T> e{x[1], x[2], x[3]}, o{T(z[3]), T(z[4]), T(z[5])};
    const V3<T> vector_part = scaled(x[0], o) + cross(e, o);
    const V4<T> product{-dot(e, o), vector_part[0], vector_part[1], vector_part[2]};
    TextbookFrame<Series<T>> f;
    for (std::size_t i = 0; i < 3; ++i) f.r[i] = Series<T>(q[i], v[i], T(0.5 * z[i]));
    V4<Series<T>> series;
    for (std::size_t i = 0; i < 4; ++i) series[i] = Series<T>(x[i], w[i], T(0.5) * (T(0.5) * product[i] - spin * x[i]));
    f.A = rotation(series);
    f.p = series;
    return f;
  }

  // Along its virtual displacement: A (I + t skew(eta_theta)), p + t/2 p * (0, eta_theta).
  TextbookFrame<Series<T>> displaced() const {
    const TextbookFrame<T> now = frame();
    const M3<T> turn{V3<T>{T(0), T(-eta[5]), T(eta[4])}, V3<T>{T(eta[5]), T(0), T(-eta[3])},
                     V3<T>{T(-eta[4]), T(eta[3]), T(0)}};
    TextbookFrame<Series<T>> f;
    for (std::size_t i = 0; i < 3; ++i) {
      f.r[i] = Series<T>(now.r[i], T(eta[i]));
      const V3<T> row = transposed_times(turn, now.A[i]);
      for (std::size_t j = 0; j < 3; ++j) f.A[i][j] = Series<T>(now.A[i][j], row[j]);
    }
    const V4<T> x = p();
    const V3<T> e{x[1], x[2], x[3]}, o{T(eta[3]), T(eta[4]), T(eta[5])}, turned = scaled(x[0], o) + cross(e, o);
    f.p = {Series<T>(x[0], T(-0.5) * dot(e, o)), Series<T>(x[1], T(0.5) * turned[0]),
           Series<T>(x[2], T(0.5) * turned[1]), Series<T>(x[3], T(0.5) * turned[2])};
    return f;
  }
};

template <class T>
V3<Series<T>> constant(const V3<T>& s) {
  return {Series<T>(s[0]), Series<T>(s[1]), Series<T>(s[2])};
}

// Gradient of f (of a std::vector<Complex>, real where its arguments are), and its derivative along one direction.
template <class F>
Eigen::VectorXd complex_gradient(const F& f, const Eigen::VectorXd& x) {
  constexpr double h = 1e-40;
  std::vector<Complex> at(x.data(), x.data() + x.size());
  Eigen::VectorXd g(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    at[static_cast<std::size_t>(i)].imag(h);
    g(i) = std::imag(f(at)) / h;
    at[static_cast<std::size_t>(i)].imag(0);
  }
  return g;
}
template <class F>
double complex_derivative(const F& f, const Eigen::VectorXd& x, const Eigen::VectorXd& direction) {
  constexpr double h = 1e-40;
  std::vector<Complex> at(static_cast<std::size_t>(x.size()));
  for (std::size_t i = 0; i < at.size(); ++i) {
    at[i] = Complex(x(static_cast<Eigen::Index>(i)), h * direction(static_cast<Eigen::Index>(i)));
  }
  return std::imag(f(at)) / h;
}

// Gradient of f (of an Eigen::VectorXd) by central differences, extrapolated once: error O(h^4).
template <class F>
Eigen::VectorXd difference_gradient(const F& f, const Eigen::VectorXd& x, double h = 1e-3) {
  Eigen::VectorXd g(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    auto slope = [&](double d) {
      Eigen::VectorXd up = x, down = x;
      up(i) += d, down(i) -= d;
      return (f(up) - f(down)) / (2 * d);
    };
    g(i) = (4 * slope(h / 2) - slope(h)) / 3;
  }
  return g;
}

template <std::size_t N, class T>
std::array<T, N> part(const std::vector<T>& x, std::size_t first) {
  std::array<T, N> out;
  for (std::size_t i = 0; i < N; ++i) out[i] = x[first + i];
  return out;
}

// Repeatable numbers of size about one.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()() { return normal_(engine_); }
  Eigen::VectorXd vector(Eigen::Index n) {
    return Eigen::VectorXd::NullaryExpr(n, [this] { return (*this)(); });
  }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace mbsopt::testing
