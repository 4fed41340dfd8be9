// A mechanism in the form of a model file, before it becomes a problem file. Bodies have their frames where the model
// file draws them. All data of a body are in its frame. Body 0 is the ground.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/import/xml_element.hpp"

namespace mbsopt {

struct ImportedShape {
  std::string type;          // as in a problem file: rod, box, sphere, cylinder
  Eigen::Vector3d from, to;  // [m]
  double radius = 0;         // [m]
};

// A bar along the longest side of the box, as wide as the longer of its other two sides.
ImportedShape box_shape(const Eigen::Vector3d& half_sides, const Eigen::Isometry3d& at);

struct ImportedBody {
  std::string name;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();           // global
  double mass = 0;                                                   // [kg]
  Eigen::Vector3d com = Eigen::Vector3d::Zero();                     // [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();                 // about com [kg m^2]
  std::vector<std::pair<std::string, Eigen::Vector3d>> points = {};  // [m]
  std::vector<ImportedShape> shapes = {};
  const XmlElement* source = nullptr;
};

struct ImportedJoint {
  std::string name;
  std::string type;  // of the problem format: revolute, translational, spherical, planar, fixed
  int body1 = 0, body2 = 0;
  Eigen::Isometry3d between = Eigen::Isometry3d::Identity();  // the frame of body2 in that of body1
  Eigen::Vector3d point = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::UnitZ();  // in the frame of body2
  double damping = 0, stiffness = 0;  // N m s/rad, N m/rad; of translational N s/m, N/m
  double free_value = 0;              // angle or displacement where the spring is at rest, from the start [rad], [m]
  double coulomb = 0;                 // [N m], [N]
  const XmlElement* source = nullptr;
};

// value(joint2) = factor value(joint1): angles or displacements, both from the start.
struct ImportedTie {
  std::string name;
  int joint1 = 0, joint2 = 0;
  double factor = 1;
  const XmlElement* source = nullptr;
};

struct ImportedModel {
  std::string name;
  Eigen::Vector3d gravity{0, 0, -9.81};  // [m/s^2]
  std::vector<ImportedBody> bodies;      // 0: the ground
  std::vector<ImportedJoint> joints;
  std::vector<ImportedTie> ties;
  std::vector<std::string> changed;  // sentences: what the problem file says otherwise
};

// Adds a rigid part to a body: its centre of mass and its inertia about it, in the axes of the body.
//   m = m1 + m2,  com = (m1 c1 + m2 c2)/m,  J = J1 + J2 + m1 m2/m (d'd I - d d'),  d = c2 - c1     (Huygens, Steiner)
void add_mass(ImportedBody& body, double mass, const Eigen::Vector3d& com, const Eigen::Matrix3d& inertia);

}  // namespace mbsopt
