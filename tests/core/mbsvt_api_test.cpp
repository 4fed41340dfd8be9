// What MBSVT 1.0 offers, call by call, as a user of this library writes it; docs/mbsvt.md is the table that points
// here.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/driven/kinematics.hpp"
#include "core/dynamics/constraint_rows.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/force/user_force.hpp"
#include "core/scene/kinematic_scene.hpp"
#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using Eigen::VectorXd;
using mbsopt::testing::f;
using mbsopt::testing::vec;

namespace {

// ADDbody, ADDmassgeom
Body rod(const std::string& name, const std::string& length) {
  Body b;
  b.name = name;
  b.mass = 2.0;
  b.com = vec(length + "/2", "0", "0");
  b.inertia = {0.001, f("2*" + length + "^2/12"), f("2*" + length + "^2/12"), 0.0, 0.0, 0.0};
  b.points["end"] = vec(length, "0", "0");
  return b;
}

// A slider-crank in the x-y plane, crank r, rod l, at the crank angle 0.4.
Scene slider_crank() {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  Parameter r, l;
  r.name = "r", r.value = 0.3;
  l.name = "L", l.value = 0.8;
  scene.parameters = {r, l};
  scene.bodies = {rod("crank", "r"), rod("rod", "L")};
  scene.bodies[0].orientation = AxisAngleField{vec("0", "0", "1"), 0.4};
  scene.bodies[1].position = vec("r*cos(0.4)", "r*sin(0.4)", "0");
  scene.bodies[1].orientation = AxisAngleField{vec("0", "0", "1"), f("-asin(r*sin(0.4)/L)")};
  Body slider;
  slider.name = "slider", slider.mass = 1.0, slider.inertia = {0.01, 0.01, 0.01, 0.0, 0.0, 0.0};
  slider.position = vec("r*cos(0.4) + L*sqrt(1 - (r*sin(0.4)/L)^2)", "0", "0");
  scene.bodies.push_back(slider);

  Joint bearing;  // ADDConstr_RevJoint
  bearing.name = "bearing", bearing.type = "revolute", bearing.body1 = "ground", bearing.body2 = "crank";
  bearing.axis1 = vec("0", "0", "1"), bearing.axis2 = vec("0", "0", "1");
  Joint crankpin;  // ADDConstr_SpheJoint
  crankpin.name = "crankpin", crankpin.type = "spherical", crankpin.body1 = "crank", crankpin.body2 = "rod";
  crankpin.point1 = "end", crankpin.point2 = "O";
  Joint plane;  // ADDConstr_dot1
  plane.name = "plane", plane.type = "perpendicular", plane.body1 = "ground", plane.body2 = "rod";
  plane.axis1 = vec("0", "0", "1"), plane.axis2 = vec("0", "1", "0");
  Joint wrist;
  wrist.name = "wrist", wrist.type = "spherical", wrist.body1 = "rod", wrist.body2 = "slider";
  wrist.point1 = "end";
  Joint guide;  // ADDConstr_TransJoint
  guide.name = "guide", guide.type = "translational", guide.body1 = "ground", guide.body2 = "slider";
  guide.axis1 = vec("1", "0", "0"), guide.axis2 = vec("1", "0", "0");
  scene.joints = {bearing, crankpin, plane, wrist, guide};

  Sensor theta, x, vx, ax;
  theta.name = "theta", theta.quantity = "angle", theta.joint = "bearing";
  x.name = "x", x.quantity = "position", x.body = "slider", x.component = "x";
  vx.name = "vx", vx.quantity = "velocity", vx.body = "slider", vx.component = "x";
  ax.name = "ax", ax.quantity = "acceleration", ax.body = "slider", ax.component = "x";
  scene.sensors = {theta, x, vx, ax};
  return scene;
}

const VectorXd kRho = Eigen::Vector2d(0.3, 0.8);

// Slider position for the crank angle a, and its derivatives in time at the rate w.
struct SliderMotion {
  double x, v, a;
  SliderMotion(double angle, double w) {
    const double r = 0.3, l = 0.8, s = std::sin(angle), c = std::cos(angle), root = std::sqrt(l * l - r * r * s * s);
    const double root_a = -r * r * s * c / root, root_aa = (-r * r * (c * c - s * s) - root_a * root_a) / root;
    x = r * c + root;
    v = (-r * s + root_a) * w;
    a = (-r * c + root_aa) * w * w;
  }
};

// The callbacks forces, stiffness, damping, PQbarPrho: a spring of its own on the body's x, rho = (k, a).
struct OwnSpring final : UserForce {
  std::vector<std::string> bodies() const override { return {"mass"}; }
  void Q(double, VecIn q, VecIn, VecIn rho, VecOut Q) const override { Q(0) = -rho(0) * (q(0) - 1); }
  void K(double, VecIn, VecIn, VecIn rho, MatOut K) const override { K(0, 0) = rho(0); }
  void C(double, VecIn, VecIn, VecIn, MatOut) const override {}
  void Q_rho(double, VecIn q, VecIn, VecIn, MatOut Q_rho) const override { Q_rho(0, 0) = -(q(0) - 1); }
};

// gfun, dgdy, dgdp: g = x^2
struct SquareOfX final : RunningCost {
  double g(double, VecIn y, VecIn) const override { return y(0) * y(0); }
  void add_g_y(double, VecIn y, VecIn, double scale, VecOut out) const override { out(0) += scale * 2 * y(0); }
  void add_g_rho(double, VecIn, VecIn, double, VecOut) const override {}
};
// AdjInit: Lambda and Mu at the end time, of the terminal cost a x
struct ScaledEnd final : TerminalCost {
  double value(VecIn y, VecIn rho) const override { return rho(1) * y(0); }
  void adjoint_init(VecIn y, VecIn rho, VecOut lambda, VecOut mu) const override { lambda(0) = rho(1), mu(1) = y(0); }
};

// A cost of accelerations and reactions: the square of a sensor.
struct SquareOfSensor final : PointCost {
  const Mechanism& mechanism;
  int sensor;
  SquareOfSensor(const Mechanism& m, const std::string& name) : mechanism(m), sensor(m.sensor(name)) {}
  double value(const StatePoint& at) const override { return std::pow(mechanism.sensor_value(sensor, at), 2); }
  double add_gradient(const StatePoint& at, double scale, VecOut y_bar, VecOut rho_bar) const override {
    const double x = mechanism.sensor_value(sensor, at);
    mechanism.add_sensor_gradient(sensor, at, 2 * scale * x, y_bar, rho_bar);
    return x * x;
  }
};

// 1.5 kg that slides along x, released at rest from x = 1 + a; rho = (k, a).
Scene oscillator() {
  Scene scene;
  scene.gravity = {0.0, 0.0, 0.0};
  Parameter k, a;
  k.name = "k", k.value = 40, a.name = "a", a.value = 0.2;
  scene.parameters = {k, a};
  Body mass;
  mass.name = "mass", mass.mass = 1.5, mass.inertia = {0.1, 0.1, 0.1, 0.0, 0.0, 0.0};
  mass.position = vec("1 + a", "0", "0");
  Joint slide;
  slide.name = "slide", slide.type = "translational", slide.body2 = "mass";
  slide.axis1 = vec("1", "0", "0"), slide.axis2 = vec("1", "0", "0");
  scene.bodies = {mass}, scene.joints = {slide};
  scene.simulation.end_time = 1.2;
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-12, scene.simulation.integrator.atol = 1e-14;
  return scene;
}

}  // namespace

TEST_CASE("MBSVT: bodies, mass geometry, constraints: the model counts its equations", "[mbsvt]") {
  const Mechanism mechanism(slider_crank(), kRho);
  CHECK(mechanism.bodies() == 3);
  CHECK(mechanism.states() == 14 * 3);  // rg, Eul and their rates
  const ModelSummary model = Assembly(mechanism, 0).summary();
  CHECK(model.equations == 5 + 3 + 1 + 3 + 5 + 3);  // the joints, and a unit norm per body: ADDConstr_UnitEulParam
  CHECK(model.rank == model.equations);
  CHECK(model.degrees_of_freedom == 1);
}

TEST_CASE("MBSVT: setDOF, position_, velocity_ and acceleration_kinematics", "[mbsvt]") {
  Scene scene = slider_crank();
  scene.conditions = {{"theta", f("0.4"), f("3")}};  // the chosen degree of freedom: 0.4 + 3 t
  std::vector<SceneIssue> issues;
  const Mechanism mechanism(kinematic_scene(scene, issues), kRho);
  REQUIRE(issues.empty());
  int seen = 0;
  const SimulationResult result = solve_kinematics(
      mechanism, Assembly(mechanism, 0), scene.simulation, {0, 0.3, 1.1}, [&](std::size_t, const StatePoint& at) {
        const SliderMotion expected(0.4 + 3 * at.t, 3);
        CHECK(mechanism.sensor_value(mechanism.sensor("x"), at) == Approx(expected.x).epsilon(1e-12));
        CHECK(mechanism.sensor_value(mechanism.sensor("vx"), at) == Approx(expected.v).epsilon(1e-11).margin(1e-12));
        CHECK(mechanism.sensor_value(mechanism.sensor("ax"), at) == Approx(expected.a).epsilon(1e-10));
        ++seen;
        return true;
      });
  INFO(result.message);
  CHECK(result.ok());
  CHECK(seen == 3);
}

TEST_CASE("MBSVT: ADDConstr_Drive_rgx, ADDConstr_Drive_dist: drives of a coordinate and of a distance", "[mbsvt]") {
  Scene scene = slider_crank();
  Drive drive;
  if (GENERATE(false, true)) {
    drive.name = "push", drive.type = "coordinate", drive.body = "slider", drive.coordinate = "x";
    drive.law = f("1 + 0.05*sin(2*t)");
  } else {
    drive.name = "cylinder", drive.type = "distance", drive.body1 = "ground", drive.body2 = "slider";
    drive.point1 = vec("-1", "0", "0");
    drive.law = f("2 + 0.05*sin(2*t)");
  }
  scene.drives = {drive};
  const Mechanism mechanism(scene, kRho);
  const Sampling sampling{{0.5, 1}, [&](std::size_t, const StatePoint& at) {
                            CHECK(std::abs(mechanism.sensor_value(1, at) - 1 - 0.05 * std::sin(2 * at.t)) < 1e-6);
                          }};
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(run.message);
  CHECK(run.ok());
}

TEST_CASE("MBSVT: ADDConstr_Drive_rgx .. rgz, eu0 .. eu3: a free body's coordinate follows its law", "[mbsvt]") {
  const std::string coordinate = GENERATE("x", "y", "z", "e0", "e1", "e2", "e3");
  Scene scene;
  Body body;
  body.name = "body", body.mass = 1.0, body.inertia = {0.2, 0.3, 0.4, 0.0, 0.0, 0.0};
  body.position = vec("0.5", "0.5", "0.5");
  body.orientation = AxisAngleField{vec("1", "1", "1"), f("2*pi/3")};  // e0 = e1 = e2 = e3 = 0.5
  scene.bodies = {body};
  Drive drive;
  drive.name = "drive", drive.type = "coordinate", drive.body = "body", drive.coordinate = coordinate;
  drive.law = f("0.5 + 0.1*sin(2*t)");
  scene.drives = {drive};
  Sensor sensor;
  sensor.name = "driven", sensor.quantity = coordinate.size() == 1 ? "position" : "orientation";
  sensor.body = "body", sensor.component = coordinate;
  scene.sensors = {sensor};
  const Mechanism mechanism(scene, VectorXd());
  int seen = 0;
  const Sampling sampling{{0, 0.5, 1}, [&](std::size_t, const StatePoint& at) {
                            CHECK(std::abs(mechanism.sensor_value(0, at) - 0.5 - 0.1 * std::sin(2 * at.t)) < 1e-6);
                            ++seen;
                          }};
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, sampling);
  INFO(coordinate << run.message);
  CHECK(run.ok());
  CHECK(seen == 3);
}

// STATE::pos, vel, ace of a drive: a routine of the user, here the cycloidal rise of a cam and its fall,
// 1 + 0.1 sin^3(angle/2) = 1 + 0.025 (3 sin(angle/2) - sin(3 angle/2)), and its derivatives.
double cam(double angle, int order) {
  const double turn = order * std::acos(-1.0) / 2;
  return (order == 0 ? 1 : 0) + 0.025 * (3 * std::pow(0.5, order) * std::sin(angle / 2 + turn) -
                                         std::pow(1.5, order) * std::sin(3 * angle / 2 + turn));
}

TEST_CASE("MBSVT: STATE::pos, vel, ace: a drive follows a routine in C++", "[mbsvt]") {
  Scene scene = slider_crank();
  Drive drive;
  drive.name = "cam", drive.type = "coordinate", drive.body = "slider", drive.coordinate = "x";
  // The argument of the routine may hold parameters: here omega = 10 r.
  drive.law = Expression::of_curve(std::make_shared<const Curve>(cam), f("10*r*t"), "cam");
  scene.drives = {drive};
  const Mechanism mechanism(scene, kRho);
  const double omega = 10 * kRho(0);
  int seen = 0;
  const SimulationResult result = solve_kinematics(
      mechanism, Assembly(mechanism, 0), scene.simulation, {0, 0.4, 1.1}, [&](std::size_t, const StatePoint& at) {
        const double angle = omega * at.t;
        CHECK(mechanism.sensor_value(mechanism.sensor("x"), at) == Approx(cam(angle, 0)).margin(1e-13));
        CHECK(mechanism.sensor_value(mechanism.sensor("vx"), at) == Approx(omega * cam(angle, 1)).margin(1e-12));
        CHECK(mechanism.sensor_value(mechanism.sensor("ax"), at) ==
              Approx(omega * omega * cam(angle, 2)).margin(1e-11));
        ++seen;
        return true;
      });
  INFO(result.message);
  CHECK(seen == 3);
  TangentSampling end;
  end.times = {1};
  end.observe = [&](std::size_t, const StatePoint& at, const Eigen::MatrixXd& y_rho) {
    const Eigen::Index x = 7 * 2;                                            // of the slider
    CHECK(y_rho(x, 0) == Approx(10 * at.t * cam(omega, 1)).epsilon(1e-11));  // d x/d r
  };
  scene.simulation.end_time = 1;
  CHECK(simulate_tlm(mechanism, scene.simulation, {}, end).ok());
}

TEST_CASE("MBSVT: acceleration_dynamics at a state", "[mbsvt]") {
  Scene scene;  // a rod from the horizontal
  scene.gravity = {0.0, -9.81, 0.0};
  Parameter length;
  length.name = "L", length.value = 1.2;
  scene.parameters = {length};
  scene.bodies = {rod("rod", "L")};
  Joint pin;
  pin.name = "pin", pin.type = "revolute", pin.body2 = "rod", pin.axis1 = vec("0", "0", "1"), pin.axis2 = pin.axis1;
  scene.joints = {pin};
  const Mechanism mechanism(scene, VectorXd::Constant(1, 1.2));
  const Assembly assembly(mechanism, 0);
  MotionSolver solver(mechanism, scene.simulation.formulation);
  const Motion& motion = solver.motion({0, assembly.result().y, assembly.result().angles}, MotionPart::all);
  CHECK(motion.z[0](5) == Approx(-1.5 * 9.81 / 1.2).epsilon(1e-12));  // omegadot = -m g L/2 / (m L^2/3)
  CHECK(motion.z[0](1) == Approx(-0.75 * 9.81).epsilon(1e-12));
}

TEST_CASE("MBSVT: initialize_CONSTANTS, integration_dynamics with a callback after each step", "[mbsvt]") {
  Scene scene = slider_crank();
  FormulationSettings& penalty = scene.simulation.formulation;
  penalty = FormulationSettings::penalty();  // without projection
  CHECK((penalty.alpha == 1e9 && penalty.xi == 1 && penalty.omega == 10));
  penalty.alpha = 1e8;
  scene.simulation.integrator.type = "rk4";
  scene.simulation.integrator.step = 1e-4;
  scene.simulation.end_time = 0.1;
  long steps = 0;
  RunOptions options;
  options.progress = [&](double t) {
    ++steps;
    return t < 0.05;  // false stops the run
  };
  const Mechanism mechanism(scene, kRho);
  const SimulationResult run = simulate(mechanism, scene.simulation, {}, {}, options);
  CHECK(run.status == SimulationStatus::stopped);
  CHECK(run.last_good_time == Approx(0.05).epsilon(1e-3));
  CHECK(steps == run.statistics.steps);
  CHECK(run.statistics.max_position_violation < 1e-5);
}

TEST_CASE("MBSVT: integration_sensitivity with callbacks, two objectives, two parameters", "[mbsvt]") {
  const Scene scene = oscillator();
  const VectorXd rho = Eigen::Vector2d(40, 0.2);
  const Mechanism mechanism(scene, rho, {}, {std::make_shared<OwnSpring>()});
  std::vector<Cost> costs(2);  // NADJ = 2
  costs[0].running = point_cost(std::make_shared<SquareOfX>(), mechanism);
  costs[1].terminal = point_cost(std::make_shared<ScaledEnd>(), mechanism);
  const SimulationResult run = GENERATE(true, false) ? simulate_adjoint(mechanism, scene.simulation, costs)
                                                     : simulate_tlm(mechanism, scene.simulation, costs);
  REQUIRE(run.ok());
  // x = 1 + a cos(w t), w = sqrt(k/m)
  const double a = 0.2, m = 1.5, T = 1.2, w = std::sqrt(40 / m), w_k = 1 / (2 * w * m);
  const double s = std::sin(w * T), c = std::cos(w * T), s2 = std::sin(2 * w * T), c2 = std::cos(2 * w * T);
  CHECK(run.psi(0) == Approx(T + 2 * a * s / w + a * a * (T / 2 + s2 / (4 * w))).epsilon(1e-10));
  CHECK(
      run.psi_rho(0, 0) ==
      Approx((2 * a * (T * c / w - s / (w * w)) + a * a * (T * c2 / (2 * w) - s2 / (4 * w * w))) * w_k).epsilon(1e-9));
  CHECK(run.psi_rho(0, 1) == Approx(2 * s / w + 2 * a * (T / 2 + s2 / (4 * w))).epsilon(1e-9));
  CHECK(run.psi(1) == Approx(a * (1 + a * c)).epsilon(1e-10));
  CHECK(run.psi_rho(1, 0) == Approx(-a * a * s * T * w_k).epsilon(1e-9));
  CHECK(run.psi_rho(1, 1) == Approx(1 + 2 * a * c).epsilon(1e-9));
}

TEST_CASE("MBSVT: gfun of accelerations and reactions, by their sensors", "[mbsvt]") {
  Scene scene = oscillator();
  scene.gravity = {0.0, -9.81, 0.0};
  std::swap(scene.joints[0].body1, scene.joints[0].body2);  // the ground is second: its moment about O is -m g x
  Sensor a, moment;
  a.name = "a", a.quantity = "acceleration", a.body = "mass", a.component = "x";
  moment.name = "moment", moment.quantity = "reaction", moment.joint = "slide";
  moment.kind = "torque", moment.component = "z";
  scene.sensors = {a, moment};
  const Mechanism mechanism(scene, Eigen::Vector2d(40, 0.2), {}, {std::make_shared<OwnSpring>()});
  std::vector<Cost> costs(3);
  costs[0].running = std::make_shared<SquareOfSensor>(mechanism, "a");
  costs[1].running = std::make_shared<SquareOfSensor>(mechanism, "moment");
  costs[2].running = point_cost(std::make_shared<SquareOfX>(), mechanism);
  const SimulationResult run = GENERATE(true, false) ? simulate_adjoint(mechanism, scene.simulation, costs)
                                                     : simulate_tlm(mechanism, scene.simulation, costs);
  INFO(run.message);
  REQUIRE(run.ok());
  // xddot = -w^2 a cos(w t), w = sqrt(k/m)
  const double a0 = 0.2, m = 1.5, T = 1.2, w = std::sqrt(40 / m), w_k = 1 / (2 * w * m);
  const double s2 = std::sin(2 * w * T), c2 = std::cos(2 * w * T), w2 = w * w;
  CHECK(run.psi(0) == Approx(a0 * a0 * w2 * (w2 * T / 2 + w * s2 / 4)).epsilon(1e-10));
  CHECK(run.psi_rho(0, 0) ==
        Approx(a0 * a0 * (2 * w2 * w * T + 3 * w2 * s2 / 4 + w2 * w * T * c2 / 2) * w_k).epsilon(1e-9));
  CHECK(run.psi_rho(0, 1) == Approx(2 * run.psi(0) / a0).epsilon(1e-9));
  const double weight = m * 9.81;
  CHECK(run.psi(1) == Approx(weight * weight * run.psi(2)).epsilon(1e-12));
  for (const int k : {0, 1}) CHECK(run.psi_rho(1, k) == Approx(weight * weight * run.psi_rho(2, k)).epsilon(1e-11));
}

TEST_CASE("MBSVT: ADDforce_TSDA instead of a spring of one's own gives the same motion and gradient", "[mbsvt]") {
  Scene scene = oscillator();
  Tsda spring;
  spring.body1 = "ground", spring.body2 = "mass";
  spring.stiffness = f("k"), spring.free_length = 1.0;
  scene.forces.push_back({"spring", spring});
  const VectorXd rho = Eigen::Vector2d(40, 0.2);
  std::vector<Cost> costs(1);
  const Mechanism mechanism(scene, rho);
  costs[0].terminal = point_cost(std::make_shared<ScaledEnd>(), mechanism);
  const SimulationResult with_tsda = simulate_adjoint(mechanism, scene.simulation, costs);
  const Scene bare = oscillator();
  const SimulationResult own =
      simulate_adjoint(Mechanism(bare, rho, {}, {std::make_shared<OwnSpring>()}), bare.simulation, costs);
  REQUIRE((with_tsda.ok() && own.ok()));
  CHECK(with_tsda.psi(0) == Approx(own.psi(0)).epsilon(1e-12));
  CHECK((with_tsda.psi_rho - own.psi_rho).cwiseAbs().maxCoeff() < 1e-11);
}

TEST_CASE("MBSVT: rg, Eul, their rates, r and rp: queries of a state", "[mbsvt]") {
  Scene scene = slider_crank();
  scene.conditions = {{"theta", f("0.4"), f("3")}};
  const Mechanism mechanism(scene, kRho);
  const Assembly assembly(mechanism, 0);
  REQUIRE(assembly.result().ok);
  const VectorXd& y = assembly.result().y;
  const StatePoint start{0, y, assembly.result().angles};
  const Eigen::Vector3d rg = y.segment<3>(0), rgp = y.segment<3>(21);    // of the first body
  const Eigen::Vector4d Eul = y.segment<4>(3), Eulp = y.segment<4>(24);  // e0..e3
  CHECK((rg - 0.15 * Eigen::Vector3d(std::cos(0.4), std::sin(0.4), 0)).norm() < 1e-12);
  CHECK((rgp - 0.45 * Eigen::Vector3d(-std::sin(0.4), std::cos(0.4), 0)).norm() < 1e-12);
  CHECK((2 * G_times(Eul, Eulp) - Eigen::Vector3d(0, 0, 3)).norm() < 1e-12);  // angular velocity, body axes
  const Eigen::Vector3d s(0.15, 0, 0);                                        // the pin, from the centre of mass
  const Eigen::Vector3d r = rg + A(Eul) * s, rp = rgp + N(Eul, s) * Eulp;     // a point and its velocity
  CHECK((r - 0.3 * Eigen::Vector3d(std::cos(0.4), std::sin(0.4), 0)).norm() < 1e-12);
  CHECK((rp - 0.9 * Eigen::Vector3d(-std::sin(0.4), std::cos(0.4), 0)).norm() < 1e-12);
  CHECK(mechanism.sensor_value(mechanism.sensor("vx"), start) == Approx(SliderMotion(0.4, 3).v).epsilon(1e-11));
  CHECK((body_row(mechanism, 0, start).tail<3>() - Eigen::Vector3d(0, 0, 3)).norm() < 1e-12);  // origin, ..., omega
}

TEST_CASE("MBSVT: Jacob and its products, at a state", "[mbsvt]") {
  Scene scene = slider_crank();
  scene.conditions = {{"theta", f("0.4"), f("3")}};
  const Mechanism mechanism(scene, kRho);
  const MechanismData& data = mechanism.data();
  const Assembly assembly(mechanism, 0);
  std::vector<Frame> frames(4);  // frames[0]: the ground
  std::vector<Vec<6>> velocity(3);
  for (int i = 1; i <= 3; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    set_position(assembly.result().y.segment<7>(7 * (i - 1)), frames[k]);
    set_velocity(assembly.result().y.segment<7>(21 + 7 * (i - 1)), frames[k]);
    velocity[k - 1] << frames[k].rdot, frames[k].omega();
  }
  ConstraintRows J(data);
  J.evaluate(frames);
  VectorXd Phidot = VectorXd::Zero(data.m);
  J.subtract_times(velocity, Phidot);  // J v: no joint moves apart
  CHECK(Phidot.cwiseAbs().maxCoeff() < 1e-12);
  // Jacob' lambda, and its product with the velocities, is lambda' J v
  std::vector<Vec<6>> load(3, Vec<6>::Zero());
  const VectorXd lambda = VectorXd::LinSpaced(data.m, -1, 2);
  J.subtract_transposed_times(lambda, load);
  double power = 0;
  for (std::size_t i = 0; i < 3; ++i) power += load[i].dot(velocity[i]);
  CHECK(std::abs(power) < 1e-12);
}
