// Forces at single points: signs, moments, limits, in closed form.
#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "core/force/bushing.hpp"
#include "tests/core/force/joint_force_cases.hpp"
#include "tests/core/force/point_force_cases.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

TEST_CASE("a bushing measures the rotation vector at any angle below half a turn, smoothly at rest", "[force]") {
  const double angle = GENERATE(0.0, 1e-12, 1e-8, 1e-4, 0.1, 0.7, 0.7227, 0.7228, 1.5, 2.8, 3.1);
  const Vector3d axis = Vector3d(1, -2, 0.5).normalized();
  Bushing bushing;
  bushing.Kt = Vector3d(3, 5, 7);
  Frame f1, f2;
  f1.A = Eigen::AngleAxisd(1.1, Vector3d(0.3, 1, -1).normalized()).matrix();
  f2.A = f1.A * Eigen::AngleAxisd(angle, axis).matrix();
  const Vector3d theta = angle * axis;
  CHECK(bushing.potential({}, f1, f2) ==
        Approx(0.5 * theta.dot(bushing.Kt.cwiseProduct(theta))).epsilon(1e-9).margin(1e-26));
  const LawScratch<LinearLaw> none({}, VectorXd(), 0);
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  bushing.add_load(none.inputs, f1, f2, load1, load2);
  // Of equal stiffnesses the torque is that of the axis; of these it is so to first order in the angle.
  Bushing uniform;
  uniform.Kt.setConstant(4);
  Vec<6> one = Vec<6>::Zero(), two = Vec<6>::Zero();
  uniform.add_load(none.inputs, f1, f2, one, two);
  CHECK((two.tail<3>() + 4 * theta).norm() <= 1e-11 * (1 + angle / (3.1416 - angle)));
  CHECK((one.tail<3>() - 4 * theta).norm() <= 1e-11 * (1 + angle / (3.1416 - angle)));
  if (angle < 1e-3) CHECK((load2.tail<3>() + bushing.Kt.cwiseProduct(theta)).norm() <= 10 * angle * angle + 1e-15);
}

TEST_CASE("friction resists the motion at its level, smoothly through rest", "[force]") {
  FrictionLaw law;
  law.coulomb = 2, law.smooth = 0.01, law.viscous = 0.5, law.breakaway = 2;
  Law::Scratch scratch;
  auto torque = [&](double rate) { return law.value(0, VectorXd(), 0, rate, scratch); };
  CHECK(torque(0) == 0);
  CHECK(torque(0.01) == Approx(2 / std::sqrt(2.0) + 0.005));
  CHECK(torque(5) == Approx(2 + 2.5).epsilon(1e-5));
  CHECK(torque(-5) == -torque(5));
  CHECK(law.derivatives(0, VectorXd(), 0, 0, scratch).f_xdot == Approx(2 / 0.01 + 0.5));
  law.breakaway = 3, law.stribeck = 0.4;
  CHECK(torque(0.4) == Approx(2 + std::exp(-1.0) + 0.2).epsilon(1e-3));
  CHECK(torque(5) == Approx(2 + 2.5).epsilon(1e-5));
  CHECK(torque(-0.4) == -torque(0.4));
}

TEST_CASE("friction whose Stribeck velocity is next to nothing is Coulomb's, with finite derivatives", "[force]") {
  FrictionLaw law;
  law.coulomb = 2, law.smooth = GENERATE(0.01, 1e-110), law.breakaway = 3, law.stribeck = 1e-110, law.slot = 0;
  FrictionLaw coulomb = law;
  coulomb.breakaway = 2, coulomb.stribeck = 1e-3;  // fallen to nothing at 0.4, too
  Law::Scratch scratch;
  VectorXd of_rho, slopes = VectorXd::Zero(FrictionLaw::kFields), of_coulomb = slopes;
  const double rate = GENERATE(0.4, -1e200, 1e-300);
  CHECK(std::isfinite(law.derivatives(0, VectorXd(), 0, rate, scratch).f_xdot));
  law.add_field_gradient(0, rate, 1, scratch, slopes, of_rho);
  coulomb.add_field_gradient(0, rate, 1, scratch, of_coulomb, of_rho);
  CHECK(slopes.allFinite());
  if (std::abs(rate) < law.stribeck) return;
  CHECK(law.value(0, VectorXd(), 0, rate, scratch) == coulomb.value(0, VectorXd(), 0, rate, scratch));
  CHECK((slopes.head(3) - of_coulomb.head(3)).norm() == 0);
}

TEST_CASE("a force at a point gives its moment about the centre of mass", "[force]") {
  AppliedForce force;
  force.s = Vector3d(0.5, 0, 0);
  Frame frame;
  frame.A = Eigen::AngleAxisd(std::acos(-1.0) / 2, Vector3d::UnitZ()).matrix();  // the point is at (0, 0.5, 0)
  Vec<6> global = Vec<6>::Zero(), in_body = Vec<6>::Zero(), expected;
  force.add_load({3, 0, 0}, frame, global);
  expected << 3, 0, 0, 0, 0, -1.5;
  CHECK((global - expected).norm() < 1e-15);
  force.in_body_axes = true;
  force.add_load({0, 2, 0}, frame, in_body);
  expected << -2, 0, 0, 0, 0, 1;
  CHECK((in_body - expected).norm() < 1e-15);
}

TEST_CASE("tension is positive when it pulls the points together", "[force]") {
  TsdaForce spring;
  spring.s1.setZero(), spring.s2.setZero();
  spring.law.k = 10, spring.law.x0 = 0.5;
  Frame ground, other;
  other.r = Vector3d(2, 0, 0);
  const LawScratch<LinearLaw> none({}, VectorXd(), 0);
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  spring.add_load(none.inputs, ground, other, load1, load2);
  CHECK(load1(0) == Approx(15));
  CHECK(load2(0) == Approx(-15));
}

TEST_CASE("a positive torsional torque resists a positive angle", "[force]") {
  RsdaForce spring;
  Angle& angle = spring.joint.measure;
  angle.s1 = Vector3d::UnitX(), angle.s3 = Vector3d::UnitY(), angle.s2 = Vector3d::UnitX();
  spring.law.k = 4, spring.law.x0 = 0.1;
  Frame ground, other;
  other.A = A(Vector4d(std::cos(0.3), 0, 0, std::sin(0.3)));  // 0.6 rad about z
  const LawScratch<LinearLaw> none({}, VectorXd(), 0);
  Vec<6> load1 = Vec<6>::Zero(), load2 = Vec<6>::Zero();
  spring.add_load(none.inputs, ground, other, load1, load2);
  CHECK(load2(5) == Approx(-2));
  CHECK(load1(5) == Approx(2));
}

TEST_CASE("a spring of zero length has no direction, no force, and finite derivatives", "[force]") {
  TsdaCase<LinearLaw> c(3);
  TsdaForce& force = c.force;
  // Both points at the origin of a body: the difference is zero exactly.
  c.f1.r.setZero(), c.f2.r.setZero();
  force.s1.setZero(), force.s2.setZero();
  REQUIRE(force.span(c.f1, c.f2).l == 0);
  const Loads l = c.loads();
  CHECK(l.load1.norm() == 0);
  CHECK(l.load2.norm() == 0);
  FrameBar bar1, bar2;
  bar1.set_zero(), bar2.set_zero();
  VectorXd theta_bar = VectorXd::Zero(10), rho_bar;
  c.pull_back(bar1, bar2, theta_bar, rho_bar);
  CHECK(bar1.r.allFinite());
  CHECK(theta_bar.allFinite());
}
