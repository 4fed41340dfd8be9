// Accelerations, reactions and the efforts of drives as sensors: closed forms, and their derivatives in the state and
// the parameters against differences, at states off the constraints.
#include "core/dynamics/motion_solver.hpp"

#include <catch2/catch.hpp>

#include "core/mechanism/planar_model.hpp"
#include "tests/core/dynamics/planar_scenes.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

Sensor reaction(const std::string& name, const std::string& joint, const std::string& kind,
                const std::string& component) {
  Sensor s;
  s.name = name, s.quantity = "reaction", s.joint = joint, s.kind = kind, s.component = component;
  return s;
}

double value(const Mechanism& mechanism, const std::string& sensor, double t, const VectorXd& y,
             const VectorXd& angles) {
  MotionSolver motion(mechanism, {});
  return mechanism.sensor_value(mechanism.sensor(sensor), {t, y, angles, &motion});
}

// A bar of mass m with its centre of mass at c from its hinge about z, at angle theta and rate w, gravity along -y.
struct SwingingBar {
  double m = 1.3, c = 0.7, J = 0.4, g = 9.81, theta = 0.6, w = -1.7;
  Scene scene;
  SwingingBar() {
    scene.gravity = {0.0, -g, 0.0};
    Body b = plain_body("bar", m, {0.2, 0.3, J, 0.0, 0.0, 0.0}, vec("0", "0", "0"));
    b.com = {c, 0.0, 0.0};
    b.orientation = AxisAngleField{vec("0", "0", "1"), theta};
    b.angular_velocity = {0.0, 0.0, w};
    scene.bodies.push_back(b);
    scene.joints.push_back(hinge("A", "ground", vec("0", "0", "0"), "bar", vec("0", "0", "0")));
  }
  VectorXd y() const {
    VectorXd x(14);
    const double C = std::cos(theta), S = std::sin(theta), h = theta / 2;
    x << c * C, c * S, 0, std::cos(h), 0, 0, std::sin(h), -c * w * S, c * w * C, 0, -w / 2 * std::sin(h), 0, 0,
        w / 2 * std::cos(h);
    return x;
  }
};

}  // namespace

TEST_CASE("acceleration and reaction of a swinging bar have their closed forms", "[sensor]") {
  SwingingBar bar;
  for (const char* k : {"x", "y"}) {
    bar.scene.sensors.push_back(point_sensor(std::string("a") + k, "acceleration", "bar", vec("1.1", "0", "0"), k));
    bar.scene.sensors.push_back(reaction(std::string("F") + k, "A", "force", k));
  }
  bar.scene.sensors.push_back(reaction("Tz", "A", "torque", "z"));
  bar.scene.sensors.push_back(reaction("F", "A", "force", "norm"));
  bar.scene.sensors.push_back(point_sensor("along", "acceleration", "bar", vec("1.1", "0", "0"), "x"));
  bar.scene.sensors.back().in_body_frame = true;
  const Mechanism mechanism(bar.scene, VectorXd());
  const double alpha = -bar.m * bar.g * bar.c * std::cos(bar.theta) / (bar.J + bar.m * bar.c * bar.c);
  const Vector3d e(std::cos(bar.theta), std::sin(bar.theta), 0), n(-e.y(), e.x(), 0);
  const Vector3d a = 1.1 * (alpha * n - bar.w * bar.w * e);
  const Vector3d F = bar.m * (bar.c * (alpha * n - bar.w * bar.w * e) + bar.g * Vector3d::UnitY());
  auto of = [&](const char* name) { return value(mechanism, name, 0, bar.y(), VectorXd()); };
  CHECK(of("ax") == Approx(a.x()).epsilon(1e-12));
  CHECK(of("ay") == Approx(a.y()).epsilon(1e-12));
  CHECK(of("along") == Approx(-1.1 * bar.w * bar.w).epsilon(1e-12));
  CHECK(of("Fx") == Approx(F.x()).epsilon(1e-11));
  CHECK(of("Fy") == Approx(F.y()).epsilon(1e-11));
  CHECK(of("F") == Approx(F.norm()).epsilon(1e-11));
  CHECK(std::abs(of("Tz")) < 1e-11);
}

Sensor imu(const std::string& name, const std::string& on, VectorField point, OrientationField axes,
           const std::string& component) {
  Sensor s = point_sensor(name, "imu", on, std::move(point), component);
  s.axes = std::move(axes);
  return s;
}

TEST_CASE("an imu on a swinging bar reads its closed form along the turned axes of its mount", "[sensor]") {
  SwingingBar bar;
  constexpr double kMount = 0.4;
  for (const char* k : {"ax", "ay", "az", "wx", "wy", "wz"})
    bar.scene.sensors.push_back(imu(k, "bar", vec("1.1", "0", "0"), RollPitchYawField{vec("0", "0", "0.4")}, k));
  const Mechanism mechanism(bar.scene, VectorXd());
  const double alpha = -bar.m * bar.g * bar.c * std::cos(bar.theta) / (bar.J + bar.m * bar.c * bar.c);
  const double along = -1.1 * bar.w * bar.w + bar.g * std::sin(bar.theta);
  const double across = 1.1 * alpha + bar.g * std::cos(bar.theta);
  auto of = [&](const char* name) { return value(mechanism, name, 0, bar.y(), VectorXd()); };
  CHECK(of("ax") == Approx(std::cos(kMount) * along + std::sin(kMount) * across).epsilon(1e-12));
  CHECK(of("ay") == Approx(std::cos(kMount) * across - std::sin(kMount) * along).epsilon(1e-12));
  CHECK(std::abs(of("az")) < 1e-12);
  CHECK(of("wz") == Approx(bar.w).epsilon(1e-14));
  CHECK(std::abs(of("wx")) + std::abs(of("wy")) < 1e-15);
}

TEST_CASE("an imu at rest reads g upwards, one on a turning table w^2 r inwards as well", "[sensor]") {
  constexpr double w = 3, r = 0.5;
  Scene scene;  // gravity along -z
  scene.bodies.push_back(plain_body("table", 2, {0.1, 0.1, 0.2, 0.0, 0.0, 0.0}, vec("0", "0", "0")));
  scene.joints.push_back(hinge("pin", "ground", vec("0", "0", "0"), "table", vec("0", "0", "0")));
  for (const char* k : {"ax", "ay", "az"}) {
    scene.sensors.push_back(imu(std::string("table_") + k, "table", vec("0.5", "0", "0"), {}, k));
    scene.sensors.push_back(imu(std::string("ground_") + k, "ground", vec("0.5", "0", "0"), {}, k));
  }
  // Its x axis points downwards.
  scene.sensors.push_back(
      imu("nose", "ground", vec("1", "2", "3"), RollPitchYawField{vec("0", "90 [deg]", "0")}, "ax"));
  const Mechanism mechanism(scene, VectorXd());
  VectorXd y = VectorXd::Zero(14);
  y(3) = 1, y(13) = w / 2;
  auto of = [&](const char* name) { return value(mechanism, name, 0, y, VectorXd()); };
  CHECK(of("ground_az") == Approx(9.81).epsilon(1e-15));
  CHECK(of("ground_ax") == 0);
  CHECK(of("ground_ay") == 0);
  CHECK(of("nose") == Approx(-9.81).epsilon(1e-14));
  CHECK(of("table_ax") == Approx(-w * w * r).epsilon(1e-13));
  CHECK(of("table_az") == Approx(9.81).epsilon(1e-13));
  CHECK(std::abs(of("table_ay")) < 1e-13);
}

TEST_CASE("the effort of an angle drive is the torque that the motion asks for", "[sensor]") {
  SwingingBar bar;
  Drive drive;
  drive.name = "motor", drive.type = "angle", drive.joint = "A", drive.law = f("0.6 - 1.7*t + 2*t^2");
  bar.scene.drives.push_back(drive);
  Sensor effort;
  effort.name = "torque", effort.quantity = "drive_force", effort.drive = "motor";
  bar.scene.sensors.push_back(effort);
  bar.scene.sensors.push_back(reaction("Tz", "A", "torque", "z"));
  const Mechanism mechanism(bar.scene, VectorXd());
  const double expected = (bar.J + bar.m * bar.c * bar.c) * 4 + bar.m * bar.g * bar.c * std::cos(bar.theta);
  CHECK(value(mechanism, "torque", 0, bar.y(), VectorXd::Zero(1)) == Approx(expected).epsilon(1e-11));
  CHECK(std::abs(value(mechanism, "Tz", 0, bar.y(), VectorXd::Zero(1))) < 1e-10);  // the joint itself turns freely
}

TEST_CASE("the torque of a fixed joint balances the load about its point", "[sensor]") {
  Scene scene;
  scene.bodies.push_back(plain_body("arm", 2, {0.1, 0.1, 0.1, 0.0, 0.0, 0.0}, vec("0.5", "0.2", "0")));
  Joint weld;
  weld.name = "weld", weld.type = "fixed", weld.body2 = "arm";
  weld.point1 = vec("0.1", "0", "0.3"), weld.point2 = vec("-0.4", "-0.2", "0.3");
  scene.joints.push_back(weld);
  for (const char* k : {"x", "y", "z"}) {
    scene.sensors.push_back(reaction(std::string("F") + k, "weld", "force", k));
    scene.sensors.push_back(reaction(std::string("T") + k, "weld", "torque", k));
  }
  const Mechanism mechanism(scene, VectorXd());
  VectorXd y = VectorXd::Zero(14);
  y.head<7>() << 0.5, 0.2, 0, 1, 0, 0, 0;
  const Vector3d load(0, 0, -2 * 9.81), arm(0.4, 0.2, -0.3), T = -arm.cross(load);
  auto of = [&](const char* name) { return value(mechanism, name, 0, y, VectorXd()); };
  CHECK(of("Fz") == Approx(2 * 9.81).epsilon(1e-12));
  CHECK(std::abs(of("Fx")) + std::abs(of("Fy")) < 1e-11);
  CHECK(of("Tx") == Approx(T.x()).epsilon(1e-11));
  CHECK(of("Ty") == Approx(T.y()).epsilon(1e-11));
  CHECK(of("Tz") == Approx(T.z()).margin(1e-11));
}

TEST_CASE("derivatives of accelerations, reactions and efforts equal differences", "[sensor]") {
  Scene scene = every_force_four_bar();
  const std::size_t first = scene.sensors.size();
  Drive drive;
  drive.name = "motor", drive.type = "angle", drive.joint = "D", drive.law = f("kt*sin(t) + 0.1*t^2*mu");
  scene.joints[3].normal1 = vec("1", "0.2", "0.1"), scene.joints[3].normal2 = vec("0.4", "1", "u");
  scene.drives.push_back(drive);
  scene.sensors.push_back(point_sensor("acc_a1", "acceleration", "coupler", vec("c2", "0.1", "off"), "y"));
  scene.sensors.push_back(point_sensor("acc_a2", "acceleration", "rocker", vec("L3", "0", "0.1"), "norm"));
  scene.sensors.back().relative_to = PointOnBody{"crank", vec("L1", "0", "0")};
  scene.sensors.push_back(point_sensor("acc_a3", "acceleration", "coupler", vec("c2", "0", "0"), "z"));
  scene.sensors.back().in_body_frame = true;
  scene.sensors.push_back(reaction("reaction_r1", "A", "force", "x"));
  scene.sensors.push_back(reaction("reaction_r2", "B", "force", "norm"));
  scene.sensors.push_back(reaction("reaction_r3", "D", "torque", "y"));
  scene.sensors.push_back(reaction("reaction_r4", "A", "torque", "norm"));
  Sensor effort;
  effort.name = "effort", effort.quantity = "drive_force", effort.drive = "motor";
  scene.sensors.push_back(effort);
  const OrientationField mount = RollPitchYawField{vec("u", "0.3", "c2")};
  scene.sensors.push_back(imu("imu_force", "coupler", vec("c2", "off", "0.1"), mount, "ax"));
  scene.sensors.push_back(imu("imu_rate", "crank", vec("0", "0", "0"), mount, "wz"));
  scene.sensors.push_back(imu("imu_ground", "ground", vec("0", "0", "0"), mount, "ay"));
  Sensor mixed;
  mixed.name = "mixed", mixed.quantity = "expression", mixed.value = f("imu_force*reaction_r2 + t*imu_rate^2 + mu");
  scene.sensors.push_back(mixed);

  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  std::srand(5);
  const MechanismData& d = mechanism.data();
  VectorXd y = 0.2 * VectorXd::Random(14 * d.n);
  for (int i = 1; i <= d.n; ++i) y.segment<7>(7 * (i - 1)) += d.bodies[static_cast<std::size_t>(i)].q;
  const VectorXd angles = VectorXd::Zero(static_cast<Eigen::Index>(d.angles.size()));
  const double t = 0.4;
  for (std::size_t i = first; i < scene.sensors.size(); ++i) {
    const std::string& name = scene.sensors[i].name;
    INFO(name);
    MotionSolver motion(mechanism, {});
    VectorXd y_bar = VectorXd::Zero(y.size()), rho_bar = VectorXd::Zero(rho.size());
    mechanism.add_sensor_gradient(static_cast<int>(i), {t, y, angles, &motion}, 1, y_bar, rho_bar);
    auto slope = [&](auto&& at, double h) {
      auto central = [&](double s) { return (at(s) - at(-s)) / (2 * s); };
      return (4 * central(h / 2) - central(h)) / 3;
    };
    const double size = 1 + y_bar.cwiseAbs().maxCoeff() + rho_bar.cwiseAbs().maxCoeff();
    for (Eigen::Index k = 0; k < y.size(); ++k) {
      const double expected = slope(
          [&](double s) {
            VectorXd moved = y;
            moved(k) += s;
            return value(mechanism, name, t, moved, angles);
          },
          1e-4);
      CHECK(std::abs(y_bar(k) - expected) < 1e-6 * size);
    }
    for (Eigen::Index k = 0; k < rho.size(); ++k) {
      const double expected = slope(
          [&](double s) {
            VectorXd moved = rho;
            moved(k) += s;
            return value(Mechanism(scene, moved), name, t, y, angles);
          },
          1e-4);
      CHECK(std::abs(rho_bar(k) - expected) < 1e-6 * size);
    }
  }
}

// The equations of space also where those of the plane suffice.
class MotionInSpace final : public MotionSource {
 public:
  explicit MotionInSpace(const Mechanism& mechanism) : solver_(mechanism, {}) {}
  const Motion& motion(const StatePoint& at, MotionPart) override { return solver_.motion(at, MotionPart::all); }
  Motion& bar(MotionPart) override { return solver_.bar(MotionPart::all); }
  void fold_bar(const StatePoint& at, VecOut y_bar, VecOut rho_bar) override { solver_.fold_bar(at, y_bar, rho_bar); }

 private:
  MotionSolver solver_;
};

TEST_CASE("what lies in the plane of a mechanism is the same by the equations of the plane", "[sensor]") {
  const int normal = GENERATE(2, 0, 1);
  const std::string t1 = std::string("xyz").substr((normal + 1) % 3, 1), n = std::string("xyz").substr(normal, 1);
  Scene scene = planar_machine(normal);
  const std::size_t first = scene.sensors.size();
  scene.sensors.push_back(point_sensor("a", "acceleration", "plate", along(normal, "edge", "0.2", "0.1"), t1));
  scene.sensors.push_back(point_sensor("a_bar", "acceleration", "bar", along(normal, "q", "0.1", "0"), "norm"));
  scene.sensors.push_back(reaction("force", "B", "force", t1));
  scene.sensors.push_back(reaction("rail_torque", "rail", "torque", n));
  Sensor effort;
  effort.name = "effort", effort.quantity = "drive_force", effort.drive = "motor";
  scene.sensors.push_back(effort);
  scene.sensors.push_back(reaction("across", "B", "torque", t1));  // the equations of space
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  REQUIRE(d.planar);
  VectorXd y = VectorXd::Zero(14 * d.n);
  for (int i = 1; i <= d.n; ++i) {
    const PlanarBody& b = d.planar->bodies[static_cast<std::size_t>(i)];
    y.segment<7>(7 * (i - 1)) = d.bodies[static_cast<std::size_t>(i)].q;
    y(7 * (d.n + i - 1) + d.planar->t1) = 0.3 * i;
    y.segment<4>(7 * (d.n + i - 1) + 3) = 0.2 * b.p_a - 0.1 * i * b.p_b;
  }
  const VectorXd angles = VectorXd::Zero(static_cast<Eigen::Index>(d.angles.size()));
  MotionSolver planar(mechanism, {});
  MotionInSpace spatial(mechanism);
  const auto gradient = [&](std::size_t sensor, MotionSource& source) {
    VectorXd y_bar = VectorXd::Zero(y.size()), rho_bar = VectorXd::Zero(d.rho.size());
    const double value =
        mechanism.add_sensor_gradient(static_cast<int>(sensor), {0.4, y, angles, &source}, 1, y_bar, rho_bar);
    VectorXd all(1 + 8 * d.n + rho_bar.size());  // in directions of the plane
    all(0) = value;
    Eigen::Index k = 1;
    for (int i = 0; i < 2 * d.n; ++i) {
      const PlanarBody& b = d.planar->bodies[static_cast<std::size_t>(i % d.n + 1)];
      const auto of = y_bar.segment<7>(7 * i);
      for (const double x : {of(d.planar->t1), of(d.planar->t2), b.p_a.dot(of.tail<4>()), b.p_b.dot(of.tail<4>())})
        all(k++) = x;
    }
    all.tail(rho_bar.size()) = rho_bar;
    return all;
  };
  for (std::size_t i = first; i < scene.sensors.size(); ++i) {
    INFO(scene.sensors[i].name);
    const VectorXd expected = gradient(i, spatial);
    CHECK(expected.tail(expected.size() - 1).norm() > 0);
    CHECK((gradient(i, planar) - expected).norm() < 1e-9 * expected.norm());
  }
}
