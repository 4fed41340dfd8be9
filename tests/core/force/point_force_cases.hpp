// Forces at points: the spring-damper between two, and the applied force or torque.
#pragma once

#include "core/force/applied.hpp"
#include "core/force/tsda.hpp"
#include "tests/core/force/force_harness.hpp"

namespace mbsopt::testing {

template <class L>
struct TsdaCase : Bodies {
  static constexpr int kGeometry = 6, kLaw = 28 + kGeometry, kFields = L::kFields, kParameters = L::kParameters,
                       kInputs = kLaw + kFields + kParameters;
  TsdaForce force;

  explicit TsdaCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    force.s1 = x.segment<3>(28), force.s2 = x.segment<3>(31);
    force.slot1 = 0, force.slot2 = 3;
    L::fill(force.law, x, kLaw, kGeometry);
  }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body1 = textbook(at, 0), body2 = textbook(at, 14);
    const auto s1 = constant(part<3>(at, 28)), s2 = constant(part<3>(at, 31));
    const auto d = body2.moving().point(s2) - body1.moving().point(s1);
    const auto change = body2.displaced().point(s2) - body1.displaced().point(s1);
    V3<T> d0, d1, d_eta;
    for (std::size_t i = 0; i < 3; ++i) d0[i] = d[i].c[0], d1[i] = d[i].c[1], d_eta[i] = change[i].c[1];
    const T l = norm(d0);
    return -L::value(at, kLaw, l, dot(d0, d1) / l) * dot(d0, d_eta) / l;
  }
  Loads loads() const {
    LawScratch<L> s(force.law, x, kLaw);
    Loads out;
    force.add_load(s.inputs, f1, f2, out.load1, out.load2);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar& bar2, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
    LawScratch<L> s(force.law, x, kLaw);
    force.pull_back(s.inputs, f1, f2, bar1, bar2, theta_bar, rho_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent& t2, const Eigen::MatrixXd& directions) const {
    LawScratch<L> s(force.law, x, kLaw);
    const Law::Value now = force.at(s.inputs, f1, f2);
    Lanes<4> fields = Lanes<4>::Zero();
    if (L::kFields > 0) fields = directions.middleRows(kLaw, 4);
    const Lanes<1> df = force.law.field_tangent(
        force.measured(s.angles, f1, f2), &fields, [&](int k) { return Lanes<1>(directions.row(kLaw + k)); },
        s.scratch);
    const Lanes<3> ds1 = directions.middleRows<3>(28), ds2 = directions.middleRows<3>(31);
    LoadTangents out;
    force.tangent(now, f1, f2, t1, t2, {df, &ds1, &ds2}, out.load1, out.load2);
    return out;
  }
};

// On body 1: geometry: the point; parameters: the components.
template <bool kTorque, bool kBodyAxes>
struct AppliedCase : Bodies {
  static constexpr int kGeometry = 3, kLaw = 28 + kGeometry, kFields = 0, kParameters = 3, kInputs = kLaw + 3;
  AppliedForce force;

  explicit AppliedCase(unsigned seed) : Bodies(seed, kInputs) { place(); }
  void place() {
    Bodies::place();
    force.is_torque = kTorque, force.in_body_axes = kBodyAxes;
    force.s = x.segment<3>(28), force.slot = 0;
  }
  Vector3d c() const { return x.segment<3>(kLaw); }

  template <class T>
  T work(const std::vector<T>& at) const {
    const TextbookBody<T> body = textbook(at, 0);
    const M3<T> rotation = body.frame().A;
    V3<T> load = part<3>(at, kLaw);
    if (kTorque) {
      if (!kBodyAxes) load = transposed_times(rotation, load);
      return dot(load, V3<T>{T(eta1(3)), T(eta1(4)), T(eta1(5))});
    }
    if (kBodyAxes) load = times(rotation, load);
    const auto change = body.displaced().point(constant(part<3>(at, 28)));
    return dot(load, V3<T>{change[0].c[1], change[1].c[1], change[2].c[1]});
  }
  Loads loads() const {
    Loads out;
    force.add_load(c(), f1, out.load1);
    return out;
  }
  void pull_back(FrameBar& bar1, FrameBar&, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) const {
    rho_bar += force.pull_back(c(), f1, bar1, theta_bar);
  }
  LoadTangents tangent(const FrameTangent& t1, const FrameTangent&, const Eigen::MatrixXd& directions) const {
    const Lanes<3> ds = directions.middleRows<3>(28), dc = directions.middleRows<3>(kLaw);
    LoadTangents out;
    force.tangent(c(), dc, f1, t1, &ds, out.load1);
    return out;
  }
};

}  // namespace mbsopt::testing
