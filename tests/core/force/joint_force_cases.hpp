// Efforts in joints: torques of a law of the angle, friction along the axis.
#pragma once

#include "core/force/joint_effort.hpp"
#include "tests/core/force/force_harness.hpp"

namespace mbsopt::testing {

template <class L>
struct RsdaCase : Bodies {
  static constexpr int kGeometry = 9, kLaw = 28 + kGeometry, kFields = L::kFields, kParameters = L::kParameters,
                       kInputs = kLaw + kFields + kParameters;
  static constexpr double kReference = 13;  // two turns on: the branch that counts
  JointEffort<Angle, typename L::ForceLaw> force;

  explicit RsdaCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    JointAngle& joint = force.joint;  // in x: n1, axis x n1, n2
    joint.measure.s1 = x.segment<3>(28), joint.measure.s3 = x.segment<3>(31), joint.measure.s2 = x.segment<3>(34);
    joint.slot1 = 0, joint.slot3 = 3, joint.slot2 = 6;
    force.angle = 0;
    L::fill(force.law, x, kLaw, kGeometry);
  }

  // atan2 near its real value: the imaginary part to first order, which is all a complex step needs.
  static double atan2_of(double S, double C) { return std::atan2(S, C); }
  static Complex atan2_of(const Complex& S, const Complex& C) {
    const double s = S.real(), c = C.real();
    return {std::atan2(s, c), (c * S.imag() - s * C.imag()) / (c * c + s * s)};
  }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const auto x1 = constant(part<3>(at, 28)), y1 = constant(part<3>(at, 31)), n2 = constant(part<3>(at, 34));
    auto series = [&](const auto& g1, const auto& g2) {
      const auto n = times(g2.A, n2);
      return std::pair(dot(n, times(g1.A, x1)), dot(n, times(g1.A, y1)));
    };
    const auto [C, S] = series(body1.moving(), body2.moving());
    const auto [C_eta, S_eta] = series(body1.displaced(), body2.displaced());
    const T D = C.c[0] * C.c[0] + S.c[0] * S.c[0];
    T angle = atan2_of(S.c[0], C.c[0]);
    const double turn = 2 * std::acos(-1.0);
    angle += turn * std::round((kReference - std::real(angle)) / turn);
    const T rate = (C.c[0] * S.c[1] - S.c[0] * C.c[1]) / D, change = (C.c[0] * S_eta.c[1] - S.c[0] * C_eta.c[1]) / D;
    return -L::value(at, kLaw, angle, rate) * change;
  }
  Loads loads() const {
    LawScratch<L> s(force.law, x, kLaw, kReference);
    Loads out;
    force.add_load(s.inputs, f1, f2, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
    LawScratch<L> s(force.law, x, kLaw, kReference);
    force.pull_back(s.inputs, f1, f2, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<L> s(force.law, x, kLaw, kReference);
    const Law::Value f = force.at(s.inputs, f1, f2);
    Lanes<L::ForceLaw::kFields> fields = Lanes<L::ForceLaw::kFields>::Zero();
    if (L::kFields > 0) fields = directions.middleRows(kLaw, L::ForceLaw::kFields);
    const Lanes<1> df = force.law.field_tangent(
        force.measured(s.angles, f1, f2), &fields, [&](int k) { return Lanes<1>(directions.row(kLaw + k)); },
        s.scratch);
    const Lanes<3> dx = directions.middleRows<3>(28), dy = directions.middleRows<3>(31),
                   dn = directions.middleRows<3>(34);
    LoadTangents out;
    force.tangent(f, f1, f2, t1, t2, {df, {&dx, &dn, &dy}}, out.load1, out.load2);
    return out;
  }
};

// Friction along an axis of body 1; geometry: the two points and the axis.
struct SlidingCase : Bodies {
  static constexpr int kGeometry = 9, kLaw = 28 + kGeometry, kFields = DryFriction::kFields, kParameters = 0;
  static constexpr int kInputs = kLaw + kFields;
  SlidingFriction force;

  explicit SlidingCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    JointDisplacement& joint = force.joint;
    joint.measure.s1 = x.segment<3>(28), joint.measure.s2 = x.segment<3>(31), joint.measure.s3 = x.segment<3>(34);
    joint.slot1 = 0, joint.slot2 = 3, joint.slot3 = 6;
    DryFriction::fill(force.law, x, kLaw, kGeometry);
  }
  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    auto displacement = [&](const auto& g1, const auto& g2) {
      const auto d = g2.point(constant(part<3>(at, 31))) - g1.point(constant(part<3>(at, 28)));
      return dot(times(g1.A, constant(part<3>(at, 34))), d);
    };
    const T rate = displacement(body1.moving(), body2.moving()).c[1];
    return -DryFriction::value(at, kLaw, rate, rate) * displacement(body1.displaced(), body2.displaced()).c[1];
  }
  Loads loads() const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    Loads out;
    force.add_load(s.inputs, f1, f2, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    force.pull_back(s.inputs, f1, f2, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<DryFriction> s(force.law, x, kLaw);
    const Law::Value f = force.at(s.inputs, f1, f2);
    const Lanes<3> s1 = directions.middleRows<3>(28), s2 = directions.middleRows<3>(31),
                   s3 = directions.middleRows<3>(34);
    const Lanes<kFields> law = directions.middleRows<kFields>(kLaw);
    const Lanes<1> df = force.law.field_tangent(
        force.measured(s.angles, f1, f2), &law, [](int) { return Lanes<1>(Lanes<1>::Zero()); }, s.scratch);
    LoadTangents out;
    force.tangent(f, f1, f2, t1, t2, {df, {&s1, &s2, &s3}}, out.load1, out.load2);
    return out;
  }
};

}  // namespace mbsopt::testing
