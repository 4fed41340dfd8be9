// One harness for every force: loads, pull-back and tangent are checked against the force's virtual work written once
// more for any scalar (complex step), and against central differences of its own loads. A new force is tested by a case
// of its own in the list of types below.
#include <catch2/catch.hpp>
#include <numeric>

#include "tests/core/force/bushing_case.hpp"
#include "tests/core/force/joint_force_cases.hpp"
#include "tests/core/force/point_force_cases.hpp"

#define BETWEEN_BODIES                                                                                         \
  TsdaCase<LinearLaw>, TsdaCase<ProgramLaw>, RsdaCase<LinearLaw>, RsdaCase<ProgramLaw>, RsdaCase<DryFriction>, \
      BushingCase, SlidingCase
#define ALL_FORCES                                                                                     \
  BETWEEN_BODIES, (AppliedCase<false, false>), (AppliedCase<false, true>), (AppliedCase<true, false>), \
      (AppliedCase<true, true>)

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

TEMPLATE_TEST_CASE("a force's loads do its virtual work", "[force]", ALL_FORCES) {
  TestType c(GENERATE(range(0u, 8u)));
  const Loads found = c.loads();
  const std::vector<double> at(c.x.data(), c.x.data() + c.x.size());
  CHECK(found.load1.dot(c.eta1) + found.load2.dot(c.eta2) == Approx(c.work(at)).margin(1e-11));
}

TEMPLATE_TEST_CASE("a force's pull-back is the gradient of its virtual work", "[force]", ALL_FORCES) {
  const TestType c(GENERATE(range(0u, 8u)));
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  constexpr int fields = TestType::kGeometry + TestType::kFields;
  VectorXd theta_bar = VectorXd::Zero(fields), rho_bar = VectorXd::Zero(TestType::kParameters);
  c.pull_back(bar1, bar2, theta_bar, rho_bar);
  VectorXd found = VectorXd::Zero(TestType::kInputs);
  add_pull_back(c.f1, bar1, Vector4d::Zero(), c.eta1.template tail<3>(), found.segment<7>(0), found.segment<7>(7));
  add_pull_back(c.f2, bar2, Vector4d::Zero(), c.eta2.template tail<3>(), found.segment<7>(14), found.segment<7>(21));
  found.segment(28, fields) = theta_bar;
  found.tail(rho_bar.size()) = rho_bar;
  const VectorXd complex_step = complex_gradient([&](const std::vector<Complex>& at) { return c.work(at); }, c.x);
  const VectorXd differences = difference_gradient(
      [&](const VectorXd& at) {
        const Loads l = moved(c, at).loads();
        return l.load1.dot(c.eta1) + l.load2.dot(c.eta2);
      },
      c.x, 1e-4);
  const double size = 1 + found.template lpNorm<Eigen::Infinity>();
  CHECK(distance(found, complex_step) < 1e-11 * size);
  CHECK(distance(found, differences) < 1e-7 * size);
}

TEMPLATE_TEST_CASE("a force's tangent is the derivative of its loads along any direction", "[force]", ALL_FORCES) {
  const unsigned seed = GENERATE(range(0u, 8u));
  const TestType c(seed);
  Random random(seed + 100);
  const Eigen::MatrixXd directions = random.vector(TestType::kInputs * kLanes).reshaped(TestType::kInputs, kLanes);
  FrameTangent t1, t2;
  set_tangent(c.f1, directions.middleRows<7>(0), directions.middleRows<7>(7), t1);
  set_tangent(c.f2, directions.middleRows<7>(14), directions.middleRows<7>(21), t2);
  const LoadTangents found = c.tangent(t1, t2, directions);
  for (int lane = 0; lane < kLanes; ++lane) {
    for (int i = 0; i < 12; ++i) {
      TestType unit = c;
      unit.eta1 = Vec<12>::Unit(i).head<6>(), unit.eta2 = Vec<12>::Unit(i).tail<6>();
      const double expected = complex_derivative([&](const std::vector<Complex>& at) { return unit.work(at); }, c.x,
                                                 VectorXd(directions.col(lane)));
      const double entry = i < 6 ? found.load1(i, lane) : found.load2(i - 6, lane);
      CHECK(entry == Approx(expected).margin(1e-11).epsilon(1e-10));
    }
  }
}

TEMPLATE_TEST_CASE("forces between two bodies balance: no resultant, no moment", "[force]", BETWEEN_BODIES) {
  TestType c(GENERATE(range(0u, 4u)));
  c.x.template segment<4>(3).normalize();
  c.x.template segment<4>(17).normalize();
  if constexpr (requires { c.kReference; }) {  // a joint angle: a common axis
    const Vector3d axis = Vector3d(c.x.template segment<3>(28)).normalized();
    const Vector3d x1 = axis.unitOrthogonal(), y1 = axis.cross(x1);
    c.x.template segment<3>(28) = x1, c.x.template segment<3>(31) = y1;
    const Matrix3d A1 = A(c.x.template segment<4>(3)), A2 = A(c.x.template segment<4>(17));
    c.x.template segment<3>(34) = A2.transpose() * A1 * (std::cos(0.3) * x1 + std::sin(0.3) * y1);
  }
  c.place();
  const Loads l = c.loads();
  const Vector3d F = l.load1.template head<3>() + l.load2.template head<3>();
  const Vector3d M = c.f1.r.cross(Vector3d(l.load1.template head<3>())) +
                     c.f2.r.cross(Vector3d(l.load2.template head<3>())) + c.f1.A * l.load1.template tail<3>() +
                     c.f2.A * l.load2.template tail<3>();
  CHECK(F.norm() < 1e-12);
  CHECK(M.norm() < 1e-11);
  CHECK(l.load1.norm() > 1e-6);
}

TEST_CASE("a spring without damping is the gradient of its potential", "[force]") {
  const unsigned seed = GENERATE(range(0u, 4u));
  auto check = [](auto c, auto stretch_squared) {
    c.x(c.kLaw + 1) = 0, c.x(c.kLaw + 3) = 0;
    c.place();
    const Loads l = c.loads();
    // Along q' = (eta_r, 1/2 G'eta_theta) the potential 1/2 k stretch^2 falls by the work of the loads.
    VectorXd direction = VectorXd::Zero(c.x.size());
    direction.segment(0, 3) = c.eta1.template head<3>();
    direction.segment(3, 4) = 0.5 * G_transposed_times(c.f1.p, c.eta1.template tail<3>());
    direction.segment(14, 3) = c.eta2.template head<3>();
    direction.segment(17, 4) = 0.5 * G_transposed_times(c.f2.p, c.eta2.template tail<3>());
    auto potential = [&](const VectorXd& at) { return 0.5 * at(c.kLaw) * stretch_squared(moved(c, at)); };
    auto slope = [&](double h) { return (potential(c.x + h * direction) - potential(c.x - h * direction)) / (2 * h); };
    const double change = (4 * slope(5e-4) - slope(1e-3)) / 3;
    CHECK(l.load1.dot(c.eta1) + l.load2.dot(c.eta2) == Approx(-change).epsilon(1e-8).margin(1e-8));
  };
  check(TsdaCase<LinearLaw>(seed), [](const TsdaCase<LinearLaw>& c) {
    const double s = c.force.span(c.f1, c.f2).l - c.force.law.x0;
    return s * s;
  });
  check(RsdaCase<LinearLaw>(seed), [](const RsdaCase<LinearLaw>& c) {
    const double s = c.force.joint.value_near(c.kReference, c.f1, c.f2) - c.force.law.x0;
    return s * s;
  });
}

TEST_CASE("power of a spring-damper is minus its force times its rate", "[force]") {
  const unsigned seed = GENERATE(range(0u, 4u));
  auto check = [](auto c, auto power) {
    for (const int first : {0, 14}) {  // p'pdot = 0
      const Vector4d p = c.x.template segment<4>(first + 3);
      const Vector4d pdot = c.x.template segment<4>(first + 10);
      c.x.template segment<4>(first + 10) = pdot - p * p.dot(pdot) / p.squaredNorm();
    }
    c.place();
    const Loads l = c.loads();
    CHECK(l.load1.dot(rigid_velocity(c.f1)) + l.load2.dot(rigid_velocity(c.f2)) == Approx(power(c)).margin(1e-11));
  };
  check(TsdaCase<LinearLaw>(seed), [](const TsdaCase<LinearLaw>& c) {
    const auto s = c.force.span(c.f1, c.f2);
    const Law& law = c.force.law;
    return -(law.k * (s.l - law.x0) + law.c * s.ldot + law.f0) * s.ldot;
  });
  check(RsdaCase<LinearLaw>(seed), [](const RsdaCase<LinearLaw>& c) {
    const Law& law = c.force.law;
    const double angle = c.force.joint.value_near(c.kReference, c.f1, c.f2), rate = c.force.joint.rate(c.f1, c.f2);
    return -(law.k * (angle - law.x0) + law.c * rate + law.f0) * rate;
  });
}

TEST_CASE("a bushing without damping is the gradient of its potential, and that has its own gradient", "[force]") {
  BushingCase c(GENERATE(range(0u, 6u)));
  c.x.segment<3>(c.kLaw + 3).setZero(), c.x.segment<3>(c.kLaw + 9).setZero();
  c.place();
  const std::vector<double> at(c.x.data(), c.x.data() + c.x.size());
  CHECK(c.force.potential({}, c.f1, c.f2) == Approx(c.potential(at)).epsilon(1e-12));

  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  constexpr int fields = BushingCase::kGeometry + BushingCase::kFields;
  const Eigen::MatrixXd theta_rho = Eigen::MatrixXd::Identity(fields, fields);
  std::vector<int> active(fields);
  std::iota(active.begin(), active.end(), 0);
  VectorXd theta_bar = VectorXd::Zero(fields), found = VectorXd::Zero(c.kInputs);
  FieldGradient gradient{theta_rho, active, 1, theta_bar};
  c.force.pull_back_potential({}, c.f1, c.f2, bar1, bar2, gradient);
  found.segment<7>(0) = pull_back_position(c.f1, bar1), found.segment<7>(14) = pull_back_position(c.f2, bar2);
  found.segment(28, fields) = theta_bar;
  const VectorXd expected = complex_gradient([&](const std::vector<Complex>& x) { return c.potential(x); }, c.x);
  CHECK(distance(found, expected) < 1e-12 * (1 + expected.lpNorm<Eigen::Infinity>()));

  const Loads l = c.loads();  // along q' = (eta_r, 1/2 G'eta_theta)
  VectorXd direction = VectorXd::Zero(c.kInputs);
  direction.segment<3>(0) = c.eta1.head<3>(), direction.segment<3>(14) = c.eta2.head<3>();
  direction.segment<4>(3) = 0.5 * G_transposed_times(c.f1.p, c.eta1.tail<3>());
  direction.segment<4>(17) = 0.5 * G_transposed_times(c.f2.p, c.eta2.tail<3>());
  CHECK(l.load1.dot(c.eta1) + l.load2.dot(c.eta2) == Approx(-expected.dot(direction)).epsilon(1e-12));
}
