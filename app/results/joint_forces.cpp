#include "app/results/joint_forces.hpp"

#include <algorithm>

#include "core/dynamics/motion_solver.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt::inline app {
namespace {

constexpr std::size_t kMostInstants = 300;  // arrows that move smoothly
constexpr std::size_t kMostJoints = 30;     // arrows that a reader tells apart; with more there are none

std::vector<const Joint*> joints_with_bodies(const Scene& scene) {
  std::vector<const Joint*> joints;
  for (const Joint& joint : scene.joints)
    if (!ties_joints(joint)) joints.push_back(&joint);
  if (joints.size() > kMostJoints) joints.clear();
  return joints;
}

Scene with_force_sensors(Scene scene) {
  std::vector<Sensor> sensors;
  for (const Joint* joint : joints_with_bodies(scene)) {
    for (const char* axis : {"x", "y", "z"}) {
      Sensor& sensor = sensors.emplace_back();
      sensor.name = "force of " + joint->name + " in " + axis;  // with spaces: no sensor of a file has this name
      sensor.quantity = "reaction";
      sensor.kind = "force";
      sensor.joint = joint->name;
      sensor.component = axis;
    }
  }
  scene.sensors.insert(scene.sensors.end(), sensors.begin(), sensors.end());
  return scene;
}

}  // namespace

JointForces::JointForces(const Scene& scene, const Eigen::VectorXd& rho, std::size_t instants)
    : instants_(instants),
      stride_(std::max<std::size_t>(1, (instants + kMostInstants - 1) / kMostInstants)),
      first_(static_cast<int>(scene.sensors.size())),
      mechanism_(with_force_sensors(scene), rho, std::vector<bool>(scene.parameters.size(), false)),
      motion_(std::make_unique<MotionSolver>(mechanism_, scene.simulation.formulation)) {
  table_.columns = {"t"};
  for (const Joint* joint : joints_with_bodies(scene))
    for (const char* axis : {".x", ".y", ".z"}) table_.columns.push_back(joint->name + axis);
}

JointForces::~JointForces() = default;

void JointForces::observe(std::size_t i, const StatePoint& at) {
  if (i % stride_ != 0 && i + 1 != instants_) return;
  StatePoint here = at;
  here.motion = at.motion ? at.motion : motion_.get();  // the laws and rows of both mechanisms are the same
  std::vector<double> row{at.t};
  for (int sensor = first_; sensor < mechanism_.sensors(); ++sensor)
    row.push_back(mechanism_.sensor_value(sensor, here));
  table_.rows.push_back(std::move(row));
}

}  // namespace mbsopt::inline app
