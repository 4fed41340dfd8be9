#include "app/results/recorded_motion.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/dynamics/motion_solver.hpp"
#include "core/run/output_times.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostInstants = 300;  // arrows that move smoothly
constexpr std::size_t kMostJoints = 30;     // arrows that a reader tells apart; with more there are none

std::vector<std::string> trajectory_columns(const Scene& scene) {
  std::vector<std::string> columns{"t"};
  for (const Body& body : scene.bodies)
    for (const char* suffix : {"x", "y", "z", "e0", "e1", "e2", "e3", "vx", "vy", "vz", "wx", "wy", "wz"})
      columns.push_back(body.name + "." + suffix);
  for (const Sensor& sensor : scene.sensors) columns.push_back(sensor.name);
  return columns;
}

std::vector<Sensor> joint_forces(const Scene& scene) {
  std::vector<Sensor> sensors;
  for (const Joint& joint : scene.joints) {
    if (ties_joints(joint)) continue;
    for (const char* axis : {"x", "y", "z"}) {
      Sensor& sensor = sensors.emplace_back();
      sensor.name = joint.name + "." + axis;
      sensor.quantity = "reaction";
      sensor.kind = "force";
      sensor.joint = joint.name;
      sensor.component = axis;
    }
  }
  if (sensors.size() > 3 * kMostJoints) sensors.clear();
  return sensors;
}

std::vector<Sensor> drive_forces(const Scene& scene) {
  std::vector<Sensor> sensors;
  for (const Drive& drive : scene.drives) {
    Sensor& sensor = sensors.emplace_back();
    sensor.name = sensor.drive = drive.name;
    sensor.quantity = "drive_force";
  }
  return sensors;
}

Scene with_sensors(Scene scene, const std::vector<Sensor>& sensors) {
  for (const Sensor& sensor : sensors)
    scene.sensors.emplace_back(sensor).name += " ";  // no sensor of a file has a name with a blank
  return scene;
}

// A table of sensors that the scene itself does not have.
class SensorTable {
 public:
  SensorTable(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<Sensor>& sensors, Trajectory& table)
      : first_(static_cast<int>(scene.sensors.size())),
        mechanism_(with_sensors(scene, sensors), rho, std::vector<bool>(scene.parameters.size(), false)),
        motion_(mechanism_, scene.simulation.formulation),
        table_(table) {
    table_.columns = {"t"};
    for (const Sensor& sensor : sensors) table_.columns.push_back(sensor.name);
  }

  void record(const StatePoint& at) {
    StatePoint here = at;
    here.motion = at.motion ? at.motion : &motion_;  // the laws and rows of both mechanisms are the same
    std::vector<double> row{at.t};
    for (int sensor = first_; sensor < mechanism_.sensors(); ++sensor)
      row.push_back(mechanism_.sensor_value(sensor, here));
    table_.rows.push_back(std::move(row));
  }

 private:
  int first_;  // sensor of the table
  Mechanism mechanism_;
  MotionSolver motion_;
  Trajectory& table_;
};

}  // namespace

Sampling record_motion(const Mechanism& mechanism, const Scene& scene, RecordedMotion& motion, bool efforts) {
  motion = {};
  motion.trajectory.columns = trajectory_columns(scene);
  const std::vector<double> times = output_times(scene.simulation);
  const std::size_t instants = times.size();
  const std::size_t stride = std::max<std::size_t>(1, (instants + kMostInstants - 1) / kMostInstants);
  const auto table = [&](const std::vector<Sensor>& sensors, Trajectory& rows) {
    return std::make_shared<SensorTable>(scene, mechanism.rho(), sensors, rows);
  };
  const auto joints = table(joint_forces(scene), motion.forces);
  const auto drives = efforts ? table(drive_forces(scene), motion.efforts) : nullptr;
  return {times, [=, &mechanism, &motion](std::size_t i, const StatePoint& at) {
            std::vector<double> row = body_columns(mechanism, at);
            for (int s = 0; s < mechanism.sensors(); ++s) row.push_back(mechanism.sensor_value(s, at));
            motion.trajectory.rows.push_back(std::move(row));
            if (i % stride == 0 || i + 1 == instants) joints->record(at);
            if (drives) drives->record(at);
          }};
}

}  // namespace mbsopt::inline app
