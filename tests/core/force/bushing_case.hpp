// The bushing, and its potential.
#pragma once

#include "core/force/bushing.hpp"
#include "tests/core/force/force_harness.hpp"

namespace mbsopt::testing {

// acos near its real value, as atan2 above.
inline double acos_of(double c) { return std::acos(c); }
inline Complex acos_of(const Complex& c) {
  return {std::acos(c.real()), -c.imag() / std::sqrt(1 - c.real() * c.real())};
}

// Geometry: the points and R0, row by row; fields: K, C, Kt, Ct.
struct BushingCase : Bodies {
  static constexpr int kGeometry = 15, kLaw = 28 + kGeometry, kFields = 12, kParameters = 0, kInputs = kLaw + kFields;
  Bushing force;

  // Some tens of degrees from rest, the Euler parameters and R0 a little off their manifolds.
  explicit BushingCase(unsigned seed) : Bodies(seed, kInputs) {
    Random random(seed + 50);
    for (const int first : {3, 17}) x.segment<4>(first) *= (1 + 0.01 * random()) / x.segment<4>(first).norm();
    const Eigen::AngleAxisd turn(0.4 + 0.2 * seed, Vector3d(random.vector(3)).normalized());
    const Matrix3d R0 = turn.matrix() * A(x.segment<4>(3)).transpose() * A(x.segment<4>(17));
    for (int i = 0; i < 3; ++i) x.segment<3>(34 + 3 * i) = R0.row(i).transpose() + 0.01 * random.vector(3);
    place();
  }
  void place() {
    Bodies::place();
    force.s1 = x.segment<3>(28), force.s2 = x.segment<3>(31);
    for (int i = 0; i < 3; ++i) force.R0.row(i) = x.segment<3>(34 + 3 * i).transpose();
    force.K = x.segment<3>(kLaw), force.C = x.segment<3>(kLaw + 3);
    force.Kt = x.segment<3>(kLaw + 6), force.Ct = x.segment<3>(kLaw + 9);
    force.slot1 = 0, force.slot2 = 3, force.slot_R0 = 6, force.slot_law = 15;
  }

  // Deflection and rotation vector along a motion or a virtual displacement, with their first derivatives.
  template <class T>
  struct Deflection {
    V3<T> d, d_dot, theta, theta_dot;
  };
  template <class T, class F>
  static Deflection<T> deflection(const std::vector<T>& at, const F& f1, const F& f2) {
    const auto D = f2.point(constant(part<3>(at, 31))) - f1.point(constant(part<3>(at, 28)));
    const auto d = transposed_times(f1.A, D);
    M3<Series<T>> R;  // A1'A2 R0'
    for (std::size_t i = 0; i < 3; ++i) {
      const auto turned = times(f2.A, constant(part<3>(at, 34 + 3 * i)));
      const auto column = transposed_times(f1.A, turned);
      for (std::size_t k = 0; k < 3; ++k) R[k][i] = column[k];
    }
    const Series<T> half(T(0.5));
    const Series<T> c = half * (R[0][0] + R[1][1] + R[2][2] - Series<T>(T(1)));
    const V3<Series<T>> a{half * (R[2][1] - R[1][2]), half * (R[0][2] - R[2][0]), half * (R[1][0] - R[0][1])};
    using std::sqrt;
    const T sine2 = T(1) - c.c[0] * c.c[0], g = acos_of(c.c[0]) / sqrt(sine2), g_c = (c.c[0] * g - T(1)) / sine2;
    const Series<T> factor(g, g_c * c.c[1]);
    Deflection<T> out;
    for (std::size_t i = 0; i < 3; ++i) {
      const Series<T> theta = factor * a[i];
      out.d[i] = d[i].c[0], out.d_dot[i] = d[i].c[1], out.theta[i] = theta.c[0], out.theta_dot[i] = theta.c[1];
    }
    return out;
  }
  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const Deflection<T> now = deflection(at, body1.moving(), body2.moving());
    const Deflection<T> change = deflection(at, body1.displaced(), body2.displaced());
    T sum(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = static_cast<std::size_t>(kLaw) + i;
      sum -= (at[k] * now.d[i] + at[k + 3] * now.d_dot[i]) * change.d_dot[i];
      sum -= (at[k + 6] * now.theta[i] + at[k + 9] * now.theta_dot[i]) * change.theta_dot[i];
    }
    return sum;
  }
  template <class T>
  T potential(const std::vector<T>& at) const {
    const Deflection<T> now = deflection(at, textbook(at, 0).moving(), textbook(at, 14).moving());
    T sum(0);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = static_cast<std::size_t>(kLaw) + i;
      sum += T(0.5) * (at[k] * now.d[i] * now.d[i] + at[k + 6] * now.theta[i] * now.theta[i]);
    }
    return sum;
  }
  Loads loads() const {
    LawScratch<LinearLaw> s({}, x, 0);
    Loads out;
    force.add_load(s.inputs, f1, f2, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
    LawScratch<LinearLaw> s({}, x, 0);
    force.pull_back(s.inputs, f1, f2, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    const Lanes<3> s1 = directions.middleRows<3>(28), s2 = directions.middleRows<3>(31);
    const Lanes<9> R0 = directions.middleRows<9>(34);
    const Lanes<12> law = directions.middleRows<12>(kLaw);
    LoadTangents out;
    force.tangent({}, f1, f2, t1, t2, {&s1, &s2, &R0, &law}, out.load1, out.load2);
    return out;
  }
};

}  // namespace mbsopt::testing
