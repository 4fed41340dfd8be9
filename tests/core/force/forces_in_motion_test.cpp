// Forces in simulated motions with closed forms, and forces that must be the same as other ones.
#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

// A body at the origin without gravity; mass 1, inertia 0.2, 0.3, 0.4 about its axes.
Scene free_body() {
  Scene s;
  s.gravity = {0.0, 0.0, 0.0};
  s.bodies.push_back(plain_body("block", 1, {0.2, 0.3, 0.4, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}));
  IntegratorSettings& integrator = s.simulation.integrator;
  integrator.type = "dopri853", integrator.rtol = 1e-11, integrator.atol = 1e-13;
  s.simulation.end_time = 2;
  return s;
}

VectorXd end_state(const Scene& scene) {
  const SimulationResult run = simulate(Mechanism(scene, nominal(scene)), scene.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  return run.y_end;
}

double end_value(Scene scene, Sensor sensor) {
  sensor.name = "wanted";
  scene.sensors.push_back(sensor);
  const Mechanism mechanism(scene, nominal(scene));
  double value = 0;
  const Sampling sampling{{scene.simulation.end_time}, [&](std::size_t, const StatePoint& at) {
                            value = mechanism.sensor_value(mechanism.sensor("wanted"), at);
                          }};
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(run.message);
  REQUIRE(run.ok());
  return value;
}

Sensor tension_of(const std::string& force) {
  Sensor s;
  s.quantity = "force", s.force = force;
  return s;
}

Scene hinged_block() {
  Scene s = free_body();
  s.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "block", vec("0", "0", "0")));
  s.sensors.push_back(angle_sensor("theta", "pin"));
  Sensor rate = angle_sensor("omega", "pin");
  rate.quantity = "rate";
  s.sensors.push_back(rate);
  return s;
}

}  // namespace

TEST_CASE("a sinusoidal force on a free body moves it as integrated by hand", "[force]") {
  Scene s = free_body();
  PointForce push;
  push.body = "block", push.components = {f("3*sin(2*t)"), f("0"), f("1")};
  s.forces.push_back({"push", push});
  const VectorXd y = end_state(s);
  // x'' = 3 sin 2t, x(0) = x'(0) = 0
  CHECK(y(0) == Approx(3.0 / 2 * 2 - 3.0 / 4 * std::sin(4.0)).epsilon(1e-9));
  CHECK(y(2) == Approx(2).epsilon(1e-10));
  CHECK((y.segment<3>(4)).norm() < 1e-14);  // it does not turn
}

TEST_CASE("a torque in the body's axes spins it up about its axis", "[force]") {
  Scene s = free_body();
  s.bodies[0].orientation = AxisAngleField{vec("1", "2", "3"), f("0.8")};
  Torque spin;
  spin.body = "block", spin.components = {f("0"), f("0.6*t^2"), f("0")}, spin.in_body_frame = true;
  s.forces.push_back({"spin", spin});
  const VectorXd y = end_state(s);
  const Eigen::Vector3d omega = omega_B(y.segment<4>(3), y.segment<4>(10));
  CHECK((omega - Eigen::Vector3d(0, 0.6 * 8 / 3 / 0.3, 0)).norm() < 1e-9);
}

TEST_CASE("a torque written with sensors is the torsional spring-damper it describes", "[force]") {
  Scene spring = hinged_block();
  spring.conditions = {value_of("theta", "0.7"), rate_of("theta", "-2")};
  Scene servo = spring;
  Rsda torsion;
  torsion.joint = "pin", torsion.stiffness = 5.0, torsion.damping = 0.3, torsion.free_angle = 0.2;
  spring.forces.push_back({"torsion", torsion});
  Torque torque;
  torque.body = "block", torque.components = {f("0"), f("0"), f("-5*(theta - 0.2) - 0.3*omega")};
  servo.forces.push_back({"servo", torque});
  CHECK((end_state(spring) - end_state(servo)).norm() < 1e-9);
}

TEST_CASE("a torsion bar in the axis of a hinge is the hinge's torsional spring", "[force]") {
  Scene spring = hinged_block();
  spring.conditions = {value_of("theta", "0.7"), rate_of("theta", "-2")};
  Scene bar = spring;
  Rsda torsion;
  torsion.joint = "pin", torsion.stiffness = 5.0, torsion.damping = 0.3, torsion.free_angle = 0.2;
  spring.forces.push_back({"torsion", torsion});
  TorsionBar straight;
  straight.body2 = "block", straight.axis = PointField(vec("0", "0", "2"));
  straight.stiffness = 5.0, straight.damping = 0.3, straight.free_angle = 0.2;
  bar.forces.push_back({"torsion", straight});
  CHECK((end_state(spring) - end_state(bar)).norm() < 1e-9);
  CHECK(end_value(bar, tension_of("torsion")) == Approx(end_value(spring, tension_of("torsion"))).epsilon(1e-9));
}

TEST_CASE("a torsion bar between free bodies keeps their energy and angular momentum", "[force]") {
  Scene s = free_body();
  s.bodies.push_back(plain_body("other", 2, {0.1, 0.25, 0.2, 0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}));
  s.bodies[0].angular_velocity = {0.3, -0.2, 1.5}, s.bodies[1].angular_velocity = {-0.2, 0.4, -1.0};
  TorsionBar bar;
  bar.body1 = "block", bar.body2 = "other", bar.axis = PointField(vec("1", "2", "6"));
  bar.stiffness = f("0.4"), bar.free_angle = f("0.5");
  s.forces.push_back({"bar", bar});
  const SimulationResult run = simulate(Mechanism(s, VectorXd()), s.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK(run.statistics.energy_drift < 1e-9 * run.statistics.energy_initial);
  const auto momentum = [&](const VectorXd& y) {  // of the spins; the centres of mass rest
    const Eigen::Vector3d J[] = {{0.2, 0.3, 0.4}, {0.1, 0.25, 0.2}};
    Eigen::Vector3d L = Eigen::Vector3d::Zero();
    for (int b = 0; b < 2; ++b) {
      const Vector4d p = y.segment<4>(7 * b + 3), pdot = y.segment<4>(7 * b + 17);
      L += A(p) * J[b].cwiseProduct(omega_B(p, pdot));
    }
    return L;
  };
  CHECK((momentum(run.y_end) - (Eigen::Vector3d(0.06, -0.06, 0.6) + Eigen::Vector3d(-0.02, 0.1, -0.2))).norm() < 1e-9);
  CHECK((run.y_end.segment<4>(3) - Vector4d(1, 0, 0, 0)).norm() > 0.1);  // it has turned
}

TEST_CASE("a body on a bushing oscillates at its natural frequencies", "[force]") {
  Scene s = free_body();
  BushingSpec mount;
  mount.body2 = "block";
  mount.stiffness = vec("0", "0", "9"), mount.torsional_stiffness = vec("0", "0", "1.6");
  s.forces.push_back({"mount", mount});
  s.bodies[0].velocity = {0.0, 0.0, 0.3};
  s.bodies[0].angular_velocity = {0.0, 0.0, 5.0};  // amplitude 2.5 rad
  const VectorXd y = end_state(s);
  CHECK(y(2) == Approx(0.3 / 3 * std::sin(3 * 2.0)).epsilon(1e-8));
  const double angle = 5.0 / 2 * std::sin(2 * 2.0);  // sqrt(1.6/0.4) = 2
  CHECK(y(3) == Approx(std::cos(angle / 2)).epsilon(1e-8));
  CHECK(y(6) == Approx(std::sin(angle / 2)).epsilon(1e-8));
}

TEST_CASE("a bushing is at rest as the file places the bodies, whatever their orientations", "[force]") {
  Scene s = free_body();
  s.bodies.push_back(plain_body("other", 2, {0.1, 0.2, 0.2, 0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}));
  s.bodies[0].orientation = AxisAngleField{vec("1", "2", "3"), f("0.8")};
  s.bodies[1].orientation = AxisAngleField{vec("-1", "0", "1"), f("2.5")};
  BushingSpec mount;
  mount.body1 = "other", mount.body2 = "block", mount.torsional_stiffness = vec("5", "6", "7");
  s.forces.push_back({"mount", mount});
  const VectorXd y = end_state(s);
  CHECK(y.tail(14).norm() < 1e-12);
}

TEST_CASE("an undamped bushing keeps the energy of a large motion; a damped one takes it", "[force]") {
  Scene s = free_body();
  BushingSpec mount;
  mount.body2 = "block", mount.point1 = vec("0.1", "0", "0"), mount.point2 = vec("0.1", "0", "0");
  mount.stiffness = vec("20", "30", "50"), mount.torsional_stiffness = vec("2", "5", "3");
  s.bodies[0].velocity = {0.5, -0.4, 0.6};
  s.bodies[0].angular_velocity = {2.0, -3.0, 2.5};
  s.forces.push_back({"mount", mount});
  s.simulation.end_time = 5;
  const SimulationResult kept = simulate(Mechanism(s, VectorXd()), s.simulation);
  REQUIRE(kept.ok());
  CHECK(kept.statistics.energy_drift < 1e-8 * kept.statistics.energy_initial);
  std::get<BushingSpec>(s.forces[0].kind).torsional_damping = vec("0.2", "0.1", "0.3");
  const SimulationResult damped = simulate(Mechanism(s, VectorXd()), s.simulation);
  REQUIRE(damped.ok());
  CHECK(damped.statistics.energy_final < 0.9 * damped.statistics.energy_initial);
}

TEST_CASE("dry friction brakes a wheel as its closed form says", "[force]") {
  Scene s = hinged_block();
  FrictionSpec brake;
  brake.joint = "pin", brake.coulomb = 1.5, brake.smooth_velocity = 0.4;
  s.forces.push_back({"brake", brake});
  s.conditions = {value_of("theta", "0"), rate_of("theta", "6")};
  s.simulation.end_time = GENERATE(1.0, 1.6, 1.9);
  Sensor rate;
  rate.quantity = "rate", rate.joint = "pin";
  const double omega = end_value(s, rate);
  // J dw/dt = -mu w/u, u = sqrt(w^2 + s^2):  F(w) = u - s artanh(s/u),  F(w0) - F(w) = mu t/J
  auto F = [](double w) {
    const double u = std::hypot(w, 0.4);
    return u - 0.4 * std::atanh(0.4 / u);
  };
  CHECK(F(6) - F(omega) == Approx(1.5 * s.simulation.end_time / 0.4).epsilon(1e-7));
}

TEST_CASE("friction along a slide brakes a block as it brakes a wheel", "[force]") {
  Scene s = free_body();
  Joint slide = hinge("slide", "ground", vec("0", "0", "0"), "block", vec("0", "0", "0"));
  slide.type = GENERATE(as<std::string>{}, "translational", "cylindrical");
  s.joints.push_back(slide);
  FrictionSpec brake;
  brake.joint = "slide", brake.coulomb = 1.5, brake.smooth_velocity = 0.4;
  if (slide.type == "cylindrical") brake.motion = "translation";
  s.forces.push_back({"brake", brake});
  Sensor along;
  along.name = "x", along.quantity = "displacement", along.joint = "slide";
  s.sensors.push_back(along);
  s.conditions = {{"x", f("0.25"), f("3")}};
  s.simulation.end_time = 1.2;
  const Mechanism mechanism(s, nominal(s));
  const VectorXd y = end_state(s);
  auto F = [](double v) {
    const double u = std::hypot(v, 0.4);
    return u - 0.4 * std::atanh(0.4 / u);
  };
  CHECK(F(3) - F(y(9)) == Approx(1.5 * 1.2).epsilon(1e-7));
  CHECK(end_value(s, along) == Approx(y(2)).epsilon(1e-12));
  s.simulation.end_time = 1e-6;
  CHECK(end_value(s, along) == Approx(0.25 + 3e-6).epsilon(1e-9));
}

TEST_CASE("a torsional spring turns a body on a cylindrical joint, which slides as it likes", "[force]") {
  Scene s = free_body();
  Joint joint = hinge("pin", "ground", vec("0", "0", "0"), "block", vec("0", "0", "0"));
  joint.type = "cylindrical";
  s.joints.push_back(joint);
  s.sensors.push_back(angle_sensor("theta", "pin"));
  s.conditions = {value_of("theta", "0.5"), rate_of("theta", "0")};
  s.bodies[0].velocity = {0.0, 0.0, 0.7};
  Rsda spring;
  spring.joint = "pin", spring.stiffness = 1.6;
  s.forces.push_back({"spring", spring});
  const VectorXd y = end_state(s);
  CHECK(2 * std::atan2(y(6), y(3)) == Approx(0.5 * std::cos(2 * 2.0)).epsilon(1e-8));  // sqrt(1.6/0.4) = 2
  CHECK(y(2) == Approx(1.4).epsilon(1e-9));
}

TEST_CASE("a force on the ground, or with a name that nobody knows, is refused with its place", "[force]") {
  auto message = [](const Scene& scene) {
    try {
      Mechanism(scene, nominal(scene));
    } catch (const SceneError& e) {
      return std::string(e.what());
    }
    return std::string("compiled");
  };
  Scene s = hinged_block();
  Torque torque;
  torque.body = "ground", torque.components = {f("0"), f("0"), f("theta")};
  s.forces.push_back({"torque", torque});
  CHECK(message(s).find("forces[0].body: is the ground") == 0);
  torque.body = "block", torque.components[2] = f("thetta");
  s.forces[0].kind = torque;
  CHECK(message(s).find("forces[0].components[2]: unknown name 'thetta'") == 0);
  Sensor tension;
  tension.name = "f", tension.quantity = "force", tension.force = "torque";
  torque.components[2] = f("theta");
  s.forces[0].kind = torque;
  s.sensors.push_back(tension);
  CHECK(message(s).find("sensors[2].force: 'torque' is a torque; only a tsda, rsda, torsion_bar, stop or contact") ==
        0);
  s.sensors.back().force = "nothing";
  CHECK(message(s).find("sensors[2].force: there is no force 'nothing'") == 0);
  s.sensors.pop_back();
  FrictionSpec brake;
  brake.joint = "pin";
  s.forces.push_back({"brake", brake});
  CHECK(message(s).find("forces[1].smooth_velocity: must be greater than 0") == 0);
}
