// The state that the parts of a compilation share: the scene, its fields at one rho, and the numbers computed so far.
// Each part is a file of its own (compile_bodies.cpp, ...). The parts run once, in the order of the declarations below.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/mechanism/field_values.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene_path.hpp"

namespace mbsopt {

struct Compilation {
  Compilation(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
              std::shared_ptr<ScenePrograms> programs);

  const Scene& scene;
  FieldValues fields;
  MechanismData data;
  std::vector<FieldVector3> com;          // of each body, the ground first; in the body frame [m]
  std::vector<FieldVector4> orientation;  // of each body in the file, the ground first
  std::vector<FieldVector3> position;     // of its centre of mass, the same [m]

  // Gives the numbers their rows of theta_rho, and returns them.
  template <std::size_t N>
  const FieldVector<N>& keep(int& slot, const FieldVector<N>& x) {
    slot = fields.slot(x);
    return x;
  }

  // Return an index by name. `where` is the place in the scene that uses the name. Throw SceneError.
  int body_index(const std::string& name, const std::string& where) const;
  std::size_t joint_index(const std::string& name, const std::string& where) const;

  // A vector in the body's axes, by name or by its components.
  FieldVector3 vector(int body, const PointField& field, const std::string& where) const;
  // A point, measured from the centre of mass.
  FieldVector3 point(int body, const PointField& field, const std::string& where) const;
  FieldVector3 direction(int body, const std::optional<PointField>& field, const std::string& where) const;
  FieldVector3 unit_axis(const FieldVector3& axis, const std::string& where) const;

  enum class Zero { normals, start };
  // The index of a joint's angle among data.angles; the first request creates it.
  int angle_of(const std::string& joint, const std::string& where, Zero zero = Zero::normals);
  // Creates the angle of body 2 from body 1 about an axis of body 1. It is 0 while corresponding axes of both bodies
  // are parallel. It measures, about the axis, a direction of body 2 that is perpendicular to the axis at 0.
  int angle_about(int body1, int body2, const std::optional<PointField>& axis, const std::string& where);

  // A vector of body 1 as body 2 sees it at the orientations in the file, made perpendicular to axis2. It is not finite
  // if the vector lies along axis2.
  FieldVector3 normal_in_file(int body1, const FieldVector3& normal1, int body2, const FieldVector3& axis2) const;

  // Adds a constraint on rows of its own. Returns the first of them.
  int add_constraint(Constraint constraint);
  // The angle or displacement of a joint as a constraint without rows. Throws SceneError if the joint has none. With
  // Zero::start an angle without normals is zero at the orientations in the file. Otherwise both normals are one
  // vector.
  Constraint joint_angle_term(const std::string& joint, Zero zero, const std::string& where);
  JointDisplacement joint_displacement(const std::string& joint, const std::string& where);
  Constraint joint_displacement_term(const std::string& joint, const std::string& where);
  FieldValue joint_displacement_in_file(const std::string& joint, const std::string& where) const;

 private:
  int add_angle(int body1, int body2, const FieldVector3& a1, const FieldVector3& n1, const FieldVector3& n2);

  std::unordered_map<std::string_view, int> bodies_;  // by name, as the next
  std::unordered_map<std::string_view, std::size_t> joints_;
  std::map<std::pair<std::size_t, Zero>, int> angle_of_joint_;
};

// The unit Euler parameters of an orientation.
FieldVector4 orientation_of(const Compilation& model, const OrientationField& field, const std::string& where);

void compile_signals(Compilation& model);
void compile_bodies(Compilation& model);
void compile_joints(Compilation& model);
void compile_drives(Compilation& model);
void compile_forces(Compilation& model);
void compile_user_forces(Compilation& model, std::vector<std::shared_ptr<const UserForce>> forces);
void compile_sensors(Compilation& model);
void compile_limits(Compilation& model);      // after the sensors they are on
void compile_conditions(Compilation& model);  // after the sensors they are on

}  // namespace mbsopt
