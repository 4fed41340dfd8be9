#include "core/constraint/constraint.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/mechanism_data.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/point_sensors.hpp"
#include "core/mechanism/state_point.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MechanismData compiled(const Scene& scene, const VectorXd& rho) { return compile(scene, rho, {}, {}); }

// Every number of a compiled mechanism that may depend on parameters, and the row of its derivative (-1: none).
struct Numbers {
  std::vector<double> value;
  std::vector<int> slot;
  void add(int first, const VectorXd& values) {
    for (int i = 0; i < values.size(); ++i) {
      value.push_back(values(i));
      slot.push_back(first < 0 ? -1 : first + i);
    }
  }
  VectorXd values() const { return Eigen::Map<const VectorXd>(value.data(), static_cast<Eigen::Index>(value.size())); }
};

Numbers numbers_of(const MechanismData& d) {
  Numbers x;
  x.add(d.slot_gravity, d.gravity);
  for (const BodyData& b : d.bodies) {
    x.add(b.slot_mass, Vec<1>(b.mass));
    VectorXd J(6);
    J << b.J(0, 0), b.J(1, 1), b.J(2, 2), b.J(0, 1), b.J(0, 2), b.J(1, 2);
    x.add(b.slot_J, J);
    x.add(b.slot_com, b.com);
    x.add(b.slot_q, b.q);
    x.add(b.slot_velocity, b.velocity);
    x.add(b.slot_angular_velocity, b.angular_velocity);
  }
  for (const Constraint& c : d.constraints) {
    std::visit(
        [&](const auto& p) {
          if constexpr (requires { p.s1; }) x.add(c.slot1, p.s1), x.add(c.slot2, p.s2);
          if constexpr (requires { p.s3; }) x.add(c.slot3, p.s3);
        },
        c.primitive);
    x.add(c.slot_factor, Vec<1>(c.factor));
  }
  for (const JointAngle& a : d.angles) {
    x.add(a.slot1, a.measure.s1), x.add(a.slot3, a.measure.s3), x.add(a.slot2, a.measure.s2);
  }
  auto add_law = [&](const Law& law) {
    VectorXd v(4);
    v << law.k, law.c, law.x0, law.f0;
    x.add(law.slot, v);
  };
  for (const TsdaForce& f : d.forces->of<TsdaForce>()) x.add(f.slot1, f.s1), x.add(f.slot2, f.s2), add_law(f.law);
  for (const RsdaForce& f : d.forces->of<RsdaForce>()) add_law(f.law);
  for (const AppliedForce& f : d.applied) x.add(f.slot, f.s);
  for (const Bushing& f : d.forces->of<Bushing>()) {
    x.add(f.slot1, f.s1), x.add(f.slot2, f.s2);
    VectorXd R0(9), law(12);
    R0 << f.R0.row(0).transpose(), f.R0.row(1).transpose(), f.R0.row(2).transpose();
    law << f.K, f.C, f.Kt, f.Ct;
    x.add(f.slot_R0, R0), x.add(f.slot_law, law);
  }
  for (const TurningFriction& f : d.forces->of<TurningFriction>()) {
    VectorXd law(FrictionLaw::kFields);
    law << f.law.coulomb, f.law.smooth, f.law.viscous, f.law.breakaway, f.law.stribeck;
    x.add(f.law.slot, law);
  }
  for (const SensorPtr& s : d.sensors) {
    const auto* p = dynamic_cast<const PointSensor*>(s.get());
    if (p) x.add(p->a.slot, p->a.s), x.add(p->b.slot, p->b.s);
  }
  for (const ConditionData& c : d.conditions) x.add(c.slot, Vec<1>(c.value));
  return x;
}

// Everything that can depend on a parameter, in one scene; all three forms of an orientation.
Scene every_field() {
  Scene s = spatial_four_bar();
  s.gravity = vec("u", "0", "-9.81*w");
  s.bodies[0].mass = f("1 + L1^2");
  s.bodies[1].inertia = {f("0.2+c1"), f("0.3"), f("0.4*L2"), f("u/20"), f("0"), f("w/50")};
  s.bodies[2].orientation = EulerParametersField{{f("cos(a3/2)"), f("u/9"), f("0.1"), f("sin(a3/2)")}};
  Tsda spring;
  spring.body2 = "rocker", spring.point1 = vec("dx", "0.2", "0"), spring.point2 = vec("c3", "off", "0");
  spring.stiffness = f("100*L1"), spring.damping = f("n"), spring.free_length = f("L3/2"), spring.actuator = f("v0");
  s.forces.push_back({"spring", spring});
  Rsda torsion;
  torsion.joint = "A", torsion.stiffness = f("n^2"), torsion.damping = f("0.1*spin"), torsion.free_angle = f("x0");
  s.forces.push_back({"torsion", torsion});
  BushingSpec mount;
  mount.body1 = "coupler", mount.body2 = "rocker", mount.point1 = vec("c2", "0", "off"),
  mount.point2 = vec("0", "n", "0");
  mount.stiffness = vec("n", "2", "L3"), mount.damping = vec("u", "0", "c2");
  mount.torsional_stiffness = vec("1", "v0", "x0"), mount.torsional_damping = vec("c1", "c3", "off");
  s.forces.push_back({"mount", mount});
  FrictionSpec brake;
  brake.joint = "A", brake.coulomb = f("n*L2"), brake.smooth_velocity = f("u^2"), brake.viscous = f("spin");
  brake.breakaway = f("L2"), brake.stribeck_velocity = f("1 + n^2");
  s.forces.push_back({"brake", brake});
  PointForce push;
  push.body = "crank", push.point = vec("c1", "off", "u"), push.components = {f("1"), f("theta"), f("t")};
  s.forces.push_back({"push", push});
  s.sensors.push_back(angle_sensor("theta", "A"));
  Sensor gap = point_sensor("gap", "position", "coupler", vec("c2", "off", "0.1"), "norm");
  gap.relative_to = PointOnBody{"crank", vec("0", "n", "0")};
  s.sensors.push_back(gap);
  s.conditions.push_back({"theta", f("x0*2"), f("v0^2")});
  return s;
}

}  // namespace

TEST_CASE("every compiled number has its exact derivative in theta_rho", "[mechanism]") {
  const Scene scene = every_field();
  const VectorXd rho = nominal(scene);
  const MechanismData d = compiled(scene, rho);
  const Numbers x = numbers_of(d);
  std::vector<bool> owned(static_cast<std::size_t>(d.slots()), false);
  for (const int slot : x.slot) {
    if (slot >= 0) owned[static_cast<std::size_t>(slot)] = true;
  }
  CHECK(std::count(owned.begin(), owned.end(), false) == 0);  // no slot without a number
  for (Eigen::Index k = 0; k < rho.size(); ++k) {
    INFO(scene.parameters[static_cast<std::size_t>(k)].name);
    auto slope = [&](double h) {
      VectorXd up = rho, down = rho;
      up(k) += h, down(k) -= h;
      return VectorXd((numbers_of(compiled(scene, up)).values() - numbers_of(compiled(scene, down)).values()) /
                      (2 * h));
    };
    const VectorXd expected = (4 * slope(5e-4) - slope(1e-3)) / 3;
    VectorXd found = VectorXd::Zero(expected.size());
    for (std::size_t i = 0; i < x.slot.size(); ++i) {
      if (x.slot[i] >= 0) found(static_cast<Eigen::Index>(i)) = d.theta_rho(x.slot[i], k);
    }
    CHECK((found - expected).cwiseAbs().maxCoeff<Eigen::PropagateNaN>() < 1e-9 * (1 + expected.norm()));
    CHECK(found.norm() > 0);
  }
}

TEST_CASE("a field that no active parameter moves owns no slot", "[mechanism]") {
  const Scene scene = every_field();
  const VectorXd rho = nominal(scene);
  std::vector<bool> active(static_cast<std::size_t>(rho.size()), false);
  CHECK(compile(scene, rho, active, {}).slots() == 0);
  active[0] = true;  // L1: crank's mass, its coupler point, the spring's stiffness
  const MechanismData d = compile(scene, rho, active, {});
  CHECK(d.theta_rho.cols() == 1);
  CHECK(d.bodies[1].slot_mass >= 0);
  CHECK(d.bodies[2].slot_mass == -1);
  CHECK(d.forces->of<TsdaForce>()[0].law.slot >= 0);
  CHECK(d.slots() == 1 + 3 + 4);
}

TEST_CASE("points are measured from the centre of mass, guesses placed by it", "[mechanism]") {
  Scene scene = pendulum();
  scene.bodies[0].position = vec("1", "2", "3");
  const MechanismData d = compiled(scene, nominal(scene));
  Vec<7> q;
  q << 1 + 0.7 * std::cos(0.1), 2 + 0.7 * std::sin(0.1), 3, std::cos(0.05), 0, 0, std::sin(0.05);
  CHECK((d.bodies[1].q - q).norm() < 1e-15);
  CHECK((std::get<Coincidence>(d.constraints[0].primitive).s2 - Vector3d(-0.7, 0, 0)).norm() < 1e-15);
  CHECK(d.m == 5);
}

TEST_CASE("the three forms of an orientation agree", "[mechanism]") {
  auto p_of = [](OrientationField orientation) {
    Scene scene = pendulum();
    scene.bodies[0].orientation = std::move(orientation);
    return Vector4d(compiled(scene, nominal(scene)).bodies[1].q.tail<4>());
  };
  // Roll about the fixed x axis, then pitch about y, then yaw about z.
  const double r = 0.3, p = -0.5, y = 1.1;
  auto about = [](double angle, int axis) { return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)); };
  const Matrix3d R = (about(y, 2) * about(p, 1) * about(r, 0)).toRotationMatrix();
  CHECK((A(p_of(RollPitchYawField{{r, p, y}})) - R).norm() < 1e-15);
  const Eigen::AngleAxisd whole(R);
  const Vector3d axis = 2.5 * whole.axis();  // any length
  CHECK((A(p_of(AxisAngleField{{axis(0), axis(1), axis(2)}, whole.angle()})) - R).norm() < 1e-14);
  const Vector4d e = p_of(RollPitchYawField{{r, p, y}});
  const double off = 1 + 5e-7;  // normalised, as far as the format allows it to be off
  CHECK((p_of(EulerParametersField{{off * e(0), off * e(1), off * e(2), off * e(3)}}) - e).norm() < 1e-15);
}

TEST_CASE("a revolute keeps axis2 along axis1, for any axis", "[mechanism]") {
  Scene scene = pendulum();
  scene.sensors.clear();  // an angle would ask for normals
  scene.joints[0].axis1 = vec("1", "2", "-0.5");
  scene.joints[0].axis2 = vec("0.3", "0", "1");
  const MechanismData d = compiled(scene, nominal(scene));
  const Vector3d axis1 = Vector3d(1, 2, -0.5).normalized(), axis2 = Vector3d(0.3, 0, 1).normalized();
  REQUIRE(d.constraints.size() == 3);
  const Dot1 &n = std::get<Dot1>(d.constraints[1].primitive), &m = std::get<Dot1>(d.constraints[2].primitive);
  Matrix3d triad;
  triad << axis1, n.s1, m.s1;
  CHECK((triad.transpose() * triad - Matrix3d::Identity()).norm() < 1e-15);
  CHECK(triad.determinant() == Approx(1));
  CHECK((n.s2 - axis2).norm() < 1e-15);
  CHECK((m.s2 - axis2).norm() < 1e-15);
}

TEST_CASE("output rows hold the body frame's origin, its velocity and the global angular velocity", "[mechanism]") {
  Scene scene = pendulum();
  const Mechanism mechanism(scene, nominal(scene));
  // A quarter turn about z, spinning at 2 rad/s about z, its centre of mass 0.7 along its x axis, origin at (1, 2, 3).
  const double h = std::sqrt(0.5);
  VectorXd y(14);
  y << 1, 2.7, 3, h, 0, 0, h, -1.4, 0, 0, -h, 0, 0, h;
  Eigen::Matrix<double, 13, 1> expected;
  expected << 1, 2, 3, h, 0, 0, h, 0, 0, 0, 0, 0, 2;
  CHECK((body_row(mechanism, 0, {0, y, VectorXd()}) - expected).norm() < 1e-15);
}

TEST_CASE("what cannot be compiled is refused with its place in the scene", "[mechanism]") {
  const Scene two = double_pendulum();
  CHECK_THROWS_WITH(Mechanism(two, nominal(two), {true}), "active: 1 flags were given for 7 parameters");
  CHECK_THROWS_WITH(Mechanism(two, nominal(two).head(6)), "parameters: 6 values were given for 7 parameters");
  auto message = [](const Scene& scene) {
    try {
      compiled(scene, nominal(scene));
    } catch (const SceneError& e) {
      return std::string(e.what());
    }
    return std::string("compiled");
  };
  Scene scene = pendulum();
  CHECK(message(scene) == "compiled");
  scene.bodies[0].mass = f("-c");
  CHECK(message(scene).find("bodies[0].mass") == 0);
  scene = pendulum();
  scene.bodies[0].com = vec("sqrt(-c)", "0", "0");
  CHECK(message(scene).find("bodies[0].com[0]") == 0);
  scene = pendulum();
  scene.joints[0].body2 = "nobody";
  CHECK(message(scene) == "joints[0].body2: there is no body 'nobody'");
  scene = pendulum();
  scene.joints[0].axis1 = vec("0", "0", "c-0.7");
  CHECK(message(scene).find("joints[0].axis1: is a zero vector") == 0);
  scene = pendulum();
  scene.joints[0].axis2 = vec("0", "1", "1");
  CHECK(message(scene).find("give normal1 and normal2") != std::string::npos);
  scene = pendulum();
  scene.joints[0].point2 = std::string("tip");
  CHECK(message(scene).find("body 'bar' has no point 'tip'") != std::string::npos);
}
