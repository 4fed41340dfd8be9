// A mechanism in the form of a model file, before it becomes a problem file. Bodies have their frames where the model
// file draws them. All data of a body are in its frame. Body 0 is the ground.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>
#include <vector>

#include "app/import/model_file.hpp"

namespace mbsopt::inline app {

struct ImportedShape {
  std::string type;          // as in a problem file: rod, box, sphere, cylinder
  Eigen::Vector3d from, to;  // [m]
  double radius = 0;         // [m]
};

struct ImportedBody {
  std::string name;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();           // global
  double mass = 0;                                                   // [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();                     // [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();                 // about com [kg m^2]
  std::vector<std::pair<std::string, Eigen::Vector3d>> points = {};  // [m]
  std::vector<ImportedShape> shapes = {};
  Finding place = {};  // in the model file; no message
};

struct ImportedJoint {
  std::string type = {};  // of the problem format: revolute, translational, spherical, planar, fixed
  int body1 = 0, body2 = 0;
  Eigen::Isometry3d between = Eigen::Isometry3d::Identity();  // the frame of body2 in that of body1
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::UnitZ();  // in the frame of body2
  double damping = 0, stiffness = 0;  // N m s/rad, N m/rad; of translational N s/m, N/m
  double free_value = 0;              // angle or displacement where the spring is at rest, from the start [rad], [m]
  double coulomb = 0;                 // [N m], [N]
  std::string name = {};
  Finding place = {};  // in the model file; no message
};

// value(joint2) = factor value(joint1): angles or displacements, both from the start.
struct ImportedTie {
  std::string name;
  std::string type;  // of the problem format: gear, rack_pinion
  int joint1 = 0, joint2 = 0;
  double factor = 1;
};

struct ImportedModel {
  std::string name;
  Eigen::Vector3d gravity{0, 0, -9.81};  // [m/s^2]
  std::vector<ImportedBody> bodies{{.name = "ground"}};
  std::vector<ImportedJoint> joints;
  std::vector<ImportedTie> ties;
  std::vector<std::string> changed;  // sentences: what the problem file says otherwise
};

// Makes unique names for a problem file. Refused characters become "_", and a number follows a taken name.
class UniqueNames {
 public:
  enum class Kind { name, identifier };  // of models, bodies and joints; of sensors and points

  // renamed receives a sentence for each changed name.
  UniqueNames(Kind kind, std::vector<std::string> taken, std::vector<std::string>* renamed)
      : kind_(kind), taken_(std::move(taken)), renamed_(renamed) {}
  std::string add(const std::string& wanted);

 private:
  Kind kind_;
  std::vector<std::string> taken_;
  std::vector<std::string>* renamed_;  // nullptr: they are not listed
};

// The readers throw InputError with every finding.
ImportedModel urdf_model(ModelFile& file);  // <robot>
ImportedModel mjcf_model(ModelFile& file);  // <mujoco>

// Writes the model as a problem file. Bodies keep the frames of the model. Joints give points and axes in these, and
// normals if two frames are turned against each other. Each revolute and translational joint has a sensor of its name.
// Damping and springs become forces. Each entry of a list has a line. model.changed receives what the problem file says
// otherwise.
std::string problem_text(ImportedModel& model);

}  // namespace mbsopt::inline app
