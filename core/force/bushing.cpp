#include "core/force/bushing.hpp"

#include <array>
#include <cmath>

#include "core/constraint/body_vector.hpp"
#include "core/linear/dual_numbers.hpp"

namespace mbsopt {

// The terms of the virtual work: D = P2 - P1, M = A1'A2, and the coordinates. Each has its value, its rate and its
// virtual change.
struct Bushing::Coordinates {
  Vector3d D, Ddot, D_eta, d, ddot, d_eta;
  Matrix3d M, Mdot, M_eta;
  Vector3d a, a_dot, a_eta, theta, thetadot, theta_eta;
  double c_dot, c_eta, g, g1, g2;  // g, dg/dc, d2g/dc2
};
// Gradient of a scalar in the coordinates.
struct Bushing::CoordinateBars {
  Vector3d d = Vector3d::Zero(), ddot = Vector3d::Zero(), d_eta = Vector3d::Zero();
  Vector3d theta = Vector3d::Zero(), thetadot = Vector3d::Zero(), theta_eta = Vector3d::Zero();
};

namespace {

// g(c) = arccos(c)/sqrt(1 - c^2) with two derivatives; from (1 - c^2) g' = c g - 1. Near c = 1, in x = 1 - c:
//   g = sum_k b_k x^k,  b_0 = 1,  b_k = b_(k-1) k/(2k + 1)          radius of convergence 2
// c > 1 lies off the rotations, and no state stays there. g continues as arcosh(c)/sqrt(c^2 - 1).
struct RotationFactor {
  double g, g1, g2;
};
RotationFactor rotation_factor(double c) {
  const double x = 1 - c;
  if (std::abs(x) < 0.25) {
    constexpr int kTerms = 24;  // the last: below 0.125^24 k^2
    static constexpr auto b = [] {
      std::array<double, kTerms> list{1};
      for (std::size_t k = 1; k < list.size(); ++k) {
        list[k] = list[k - 1] * static_cast<double>(k) / (2 * static_cast<double>(k) + 1);
      }
      return list;
    }();
    RotationFactor f{0, 0, 0};
    for (std::size_t k = b.size(); k-- > 0;) {  // Horner, with the derivatives in x
      f.g2 = f.g2 * x + 2 * f.g1;
      f.g1 = f.g1 * x + f.g;
      f.g = f.g * x + b[k];
    }
    return {f.g, -f.g1, f.g2};
  }
  const double sin2 = 1 - c * c, phi = c > 1 ? std::acosh(c) : std::acos(c), g = phi / std::sqrt(std::abs(sin2));
  const double g1 = (c * g - 1) / sin2;
  return {g, g1, (g + 3 * c * g1) / sin2};
}

// (X(2,1) - X(1,2), X(0,2) - X(2,0), X(1,0) - X(0,1)): <X, skew(e)> = e'(this)
template <class T>
Eigen::Matrix<T, 3, 1> twice_vee(const Eigen::Matrix<T, 3, 3>& X) {
  return {T(X(2, 1) - X(1, 2)), T(X(0, 2) - X(2, 0)), T(X(1, 0) - X(0, 1))};
}

// The loads for any scalar: double, or Dual for their tangents.
template <class T>
struct FrameOf {
  Eigen::Matrix<T, 3, 1> r, rdot;
  Eigen::Matrix<T, 3, 3> A, Adot;
};
template <class T>
struct FieldsOf {
  Eigen::Matrix<T, 3, 1> s1, s2, K, C, Kt, Ct;
  Eigen::Matrix<T, 3, 3> R0;
};

double value_of(double x) { return x; }
double value_of(const Dual& x) { return x.value(); }
// A function's value at c, from its value and slope there.
double chained(double value, double, double) { return value; }
Dual chained(double value, double slope, const Dual& c) { return {value, slope * c.derivatives()}; }

// All calls are inlined: dual numbers that functions return are slow. With the checks of a sanitizer in each of them
// g++ would take half an hour.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define MBSOPT_FLATTEN
#else
#define MBSOPT_FLATTEN [[gnu::flatten]]
#endif
template <class T>
MBSOPT_FLATTEN void loads(const FrameOf<T>& f1, const FrameOf<T>& f2, const FieldsOf<T>& x,
                          Eigen::Matrix<T, 6, 1>& load1, Eigen::Matrix<T, 6, 1>& load2) {
  using V = Eigen::Matrix<T, 3, 1>;
  using M3 = Eigen::Matrix<T, 3, 3>;
  const M3 A1t = f1.A.transpose(), A2t = f2.A.transpose(), A1dot_t = f1.Adot.transpose(), R0t = x.R0.transpose();
  const V D = f2.r + V(f2.A * x.s2) - f1.r - V(f1.A * x.s1);
  const V Ddot = f2.rdot + V(f2.Adot * x.s2) - f1.rdot - V(f1.Adot * x.s1);
  const V d = A1t * D, ddot = V(A1dot_t * D) + V(A1t * Ddot);
  const V f = V(x.K.cwiseProduct(d)) + V(x.C.cwiseProduct(ddot));
  const V F = f1.A * f;
  const M3 M = A1t * f2.A, Mdot = M3(A1dot_t * f2.A) + M3(A1t * f2.Adot);
  const M3 R = M * R0t, Rdot = Mdot * R0t;
  const T half(0.5), one(1.0);
  const V a = V(twice_vee<T>(R)) * half, a_dot = V(twice_vee<T>(Rdot)) * half;
  const T c = (R(0, 0) + R(1, 1) + R(2, 2) - one) * half, c_dot = (Rdot(0, 0) + Rdot(1, 1) + Rdot(2, 2)) * half;
  const RotationFactor factor = rotation_factor(value_of(c));
  const T g = chained(factor.g, factor.g1, c), g1 = chained(factor.g1, factor.g2, c);
  const T g_dot = g1 * c_dot;
  const V theta = a * g, thetadot = V(a * g_dot) + V(a_dot * g);
  const V tau = V(x.Kt.cwiseProduct(theta)) + V(x.Ct.cwiseProduct(thetadot));
  // -tau'theta_eta = <Y, M_eta>,  Y = -1/2 (g' (tau'a) I + g skew(tau)) R0,  M_eta = -skew(eta1) M + M skew(eta2)
  const T along = g1 * tau.dot(a);
  M3 X;
  X << along, T(-g * tau(2)), T(g * tau(1)), T(g * tau(2)), along, T(-g * tau(0)), T(-g * tau(1)), T(g * tau(0)), along;
  const M3 Y = M3(X * x.R0) * T(-0.5);
  const M3 Mt = M.transpose(), Y_Mt = Y * Mt, Mt_Y = Mt * Y;
  load1.template head<3>() += F;
  load1.template tail<3>() += V(x.s1.cross(V(A1t * F))) + V(d.cross(f)) - V(twice_vee<T>(Y_Mt));
  load2.template head<3>() -= F;
  load2.template tail<3>() += V(twice_vee<T>(Mt_Y)) - V(x.s2.cross(V(A2t * F)));
}

template <int N>
Eigen::Matrix<Dual, N, 1> dual(const Vec<N>& value, const Lanes<N>* direction) {
  Eigen::Matrix<Dual, N, 1> x;
  for (int i = 0; i < N; ++i) {
    x(i) = Dual(value(i));
    if (direction) x(i).derivatives() = direction->row(i).transpose();
  }
  return x;
}
Eigen::Matrix<Dual, 3, 3> dual(const Matrix3d& value, const Lanes<9>* direction) {
  Eigen::Matrix<Dual, 3, 3> x;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      x(i, j) = Dual(value(i, j));
      if (direction) x(i, j).derivatives() = direction->row(3 * i + j).transpose();
    }
  }
  return x;
}
FrameOf<Dual> dual(const Frame& f, const FrameTangent& t) {
  return {dual<3>(f.r, &t.r), dual<3>(f.rdot, &t.rdot), dual(f.A, &t.A), dual(f.Adot, &t.Adot)};
}

}  // namespace

void Bushing::add_load(const ForceInputs&, const Frame& f1, const Frame& f2, Vec<6>& load1, Vec<6>& load2) const {
  loads<double>({f1.r, f1.rdot, f1.A, f1.Adot}, {f2.r, f2.rdot, f2.A, f2.Adot}, {s1, s2, K, C, Kt, Ct, R0}, load1,
                load2);
}

void Bushing::tangent(const At&, const Frame& f1, const Frame& f2, const FrameTangent& t1, const FrameTangent& t2,
                      const FieldLanes& dir, Lanes<6>& load1, Lanes<6>& load2) const {
  Vec<12> law;
  law << K, C, Kt, Ct;
  const Eigen::Matrix<Dual, 12, 1> x = dual<12>(law, dir.law);
  const FieldsOf<Dual> fields{dual<3>(s1, dir.s1), dual<3>(s2, dir.s2), x.segment<3>(0), x.segment<3>(3),
                              x.segment<3>(6),     x.segment<3>(9),     dual(R0, dir.R0)};
  Eigen::Matrix<Dual, 6, 1> l1 = Eigen::Matrix<Dual, 6, 1>::Constant(Dual(0.0)), l2 = l1;
  loads<Dual>(dual(f1, t1), dual(f2, t2), fields, l1, l2);
  for (int i = 0; i < 6; ++i) {
    load1.row(i) += l1(i).derivatives().transpose();
    load2.row(i) += l2(i).derivatives().transpose();
  }
}

void Bushing::add_field_tangent(const ForceInputs&, const ParameterBlock& block, const Frame& f1, const Frame& f2,
                                Lanes<6>& load1, Lanes<6>& load2) const {
  Lanes<3> s1_dir, s2_dir;
  Lanes<9> R0_dir;
  Lanes<12> law_dir;
  const FieldLanes dir{block.field<3>(slot1, s1_dir), block.field<3>(slot2, s2_dir), block.field<9>(slot_R0, R0_dir),
                       block.field<12>(slot_law, law_dir)};
  if (dir.s1 || dir.s2 || dir.R0 || dir.law) tangent({}, f1, f2, kStill, kStill, dir, load1, load2);
}

Bushing::Coordinates Bushing::coordinates(const Frame& f1, const Frame& f2) const {
  Coordinates x;
  x.D = f2.point(s2) - f1.point(s1);
  x.Ddot = f2.point_dot(s2) - f1.point_dot(s1);
  x.D_eta = f2.point_eta(s2) - f1.point_eta(s1);
  x.d = f1.A.transpose() * x.D;
  x.ddot = f1.Adot.transpose() * x.D + f1.A.transpose() * x.Ddot;
  x.d_eta = f1.A_eta.transpose() * x.D + f1.A.transpose() * x.D_eta;
  x.M = f1.A.transpose() * f2.A;
  x.Mdot = f1.Adot.transpose() * f2.A + f1.A.transpose() * f2.Adot;
  x.M_eta = f1.A_eta.transpose() * f2.A + f1.A.transpose() * f2.A_eta;
  const Matrix3d R = x.M * R0.transpose(), Rdot = x.Mdot * R0.transpose(), R_eta = x.M_eta * R0.transpose();
  x.a = 0.5 * twice_vee<double>(R);
  x.a_dot = 0.5 * twice_vee<double>(Rdot);
  x.a_eta = 0.5 * twice_vee<double>(R_eta);
  const RotationFactor factor = rotation_factor(0.5 * (R.trace() - 1));
  x.g = factor.g;
  x.g1 = factor.g1;
  x.g2 = factor.g2;
  x.c_dot = 0.5 * Rdot.trace();
  x.c_eta = 0.5 * R_eta.trace();
  x.theta = x.g * x.a;
  x.thetadot = x.g1 * x.c_dot * x.a + x.g * x.a_dot;
  x.theta_eta = x.g1 * x.c_eta * x.a + x.g * x.a_eta;
  return x;
}

void Bushing::spread(const Coordinates& x, const CoordinateBars& bars, const Frame& f1, const Frame& f2, FrameBar& bar1,
                     FrameBar& bar2, auto&& fields) const {
  // d = A1'D, ddot = A1dot'D + A1'Ddot, d_eta = A1_eta'D + A1'D_eta
  const Vector3d D = f1.A * bars.d + f1.Adot * bars.ddot + f1.A_eta * bars.d_eta, Ddot = f1.A * bars.ddot,
                 D_eta = f1.A * bars.d_eta;
  bar1.A += x.D * bars.d.transpose() + x.Ddot * bars.ddot.transpose() + x.D_eta * bars.d_eta.transpose();
  bar1.Adot += x.D * bars.ddot.transpose();
  bar1.A_eta += x.D * bars.d_eta.transpose();
  const VectorJet D_bar{{D, Ddot, Vector3d::Zero()}, D_eta};
  Vector3d s1_bar = Vector3d::Zero(), s2_bar = Vector3d::Zero();
  add_point_bar(f2, s2, D_bar, 1, bar2, s2_bar);
  add_point_bar(f1, s1, D_bar, -1, bar1, s1_bar);
  fields.template add<3>(slot1, s1_bar);
  fields.template add<3>(slot2, s2_bar);

  // theta = g a, thetadot = g' c_dot a + g a_dot, theta_eta = g' c_eta a + g a_eta
  const Vector3d a_bar = x.g * bars.theta + x.g1 * (x.c_dot * bars.thetadot + x.c_eta * bars.theta_eta);
  const Vector3d a_dot_bar = x.g * bars.thetadot, a_eta_bar = x.g * bars.theta_eta;
  const double c_bar = x.g1 * x.a.dot(bars.theta) + (x.g2 * x.c_dot * x.a + x.g1 * x.a_dot).dot(bars.thetadot) +
                       (x.g2 * x.c_eta * x.a + x.g1 * x.a_eta).dot(bars.theta_eta);
  const double c_dot_bar = x.g1 * x.a.dot(bars.thetadot), c_eta_bar = x.g1 * x.a.dot(bars.theta_eta);
  auto of_rotation = [](double c, const Vector3d& a) { return Matrix3d(0.5 * (c * Matrix3d::Identity() + skew(a))); };
  const Matrix3d R = of_rotation(c_bar, a_bar), Rdot = of_rotation(c_dot_bar, a_dot_bar),
                 R_eta = of_rotation(c_eta_bar, a_eta_bar);
  // R = M R0', M = A1'A2, and so on
  const Matrix3d M = R * R0, Mdot = Rdot * R0, M_eta = R_eta * R0;
  const Matrix3d R0_bar = R.transpose() * x.M + Rdot.transpose() * x.Mdot + R_eta.transpose() * x.M_eta;
  Vec<9> rows;
  for (int i = 0; i < 3; ++i) rows.segment<3>(3 * i) = R0_bar.row(i).transpose();
  fields.template add<9>(slot_R0, rows);
  bar1.A += f2.A * M.transpose() + f2.Adot * Mdot.transpose() + f2.A_eta * M_eta.transpose();
  bar1.Adot += f2.A * Mdot.transpose();
  bar1.A_eta += f2.A * M_eta.transpose();
  bar2.A += f1.A * M + f1.Adot * Mdot + f1.A_eta * M_eta;
  bar2.Adot += f1.A * Mdot;
  bar2.A_eta += f1.A * M_eta;
}

void Bushing::pull_back(const ForceInputs&, const Frame& f1, const Frame& f2, FrameBar& bar1, FrameBar& bar2,
                        Eigen::VectorXd& theta_bar, Eigen::VectorXd&) const {
  const Coordinates x = coordinates(f1, f2);
  CoordinateBars bars;
  bars.d = -K.cwiseProduct(x.d_eta);
  bars.ddot = -C.cwiseProduct(x.d_eta);
  bars.d_eta = -(K.cwiseProduct(x.d) + C.cwiseProduct(x.ddot));
  bars.theta = -Kt.cwiseProduct(x.theta_eta);
  bars.thetadot = -Ct.cwiseProduct(x.theta_eta);
  bars.theta_eta = -(Kt.cwiseProduct(x.theta) + Ct.cwiseProduct(x.thetadot));
  ThetaGradient fields{theta_bar};
  spread(x, bars, f1, f2, bar1, bar2, fields);
  Vec<12> law;
  law << x.d_eta.cwiseProduct(x.d), x.d_eta.cwiseProduct(x.ddot), x.theta_eta.cwiseProduct(x.theta),
      x.theta_eta.cwiseProduct(x.thetadot);
  fields.add<12>(slot_law, -law);
}

double Bushing::potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2) const {
  const Coordinates x = coordinates(f1, f2);
  return 0.5 * (x.d.dot(K.cwiseProduct(x.d)) + x.theta.dot(Kt.cwiseProduct(x.theta)));
}

void Bushing::pull_back_potential(const Eigen::VectorXd&, const Frame& f1, const Frame& f2, FrameBar& bar1,
                                  FrameBar& bar2, FieldGradient& fields) const {
  const Coordinates x = coordinates(f1, f2);
  CoordinateBars bars;
  bars.d = K.cwiseProduct(x.d);
  bars.theta = Kt.cwiseProduct(x.theta);
  spread(x, bars, f1, f2, bar1, bar2, fields);
  Vec<12> law = Vec<12>::Zero();
  law.head<3>() = 0.5 * x.d.cwiseAbs2();
  law.segment<3>(6) = 0.5 * x.theta.cwiseAbs2();
  fields.add<12>(slot_law, law);
}

}  // namespace mbsopt
