// What the parts of a compilation share: the scene, its fields at one rho, and the numbers found so far. Each part is a
// file of its own (compile_bodies.cpp, ...) and is run once, in the order of the declarations below.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/mechanism/field_values.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene_path.hpp"

namespace mbsopt {

struct Compilation {
  Compilation(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active);

  const Scene& scene;
  FieldValues fields;
  MechanismData data;
  std::vector<DualVector3> com;  // of each body, the ground first; in the body frame [m]

  // Gives the numbers their rows of theta_rho, and returns them.
  template <std::size_t N>
  const DualVector<N>& keep(int& slot, const DualVector<N>& x) {
    slot = fields.slot(x);
    return x;
  }

  // Indices by name; `where` is the place in the scene that uses the name. Throw SceneError.
  int body_index(const std::string& name, const std::string& where) const;
  std::size_t joint_index(const std::string& name, const std::string& where) const;

  // A vector in the body's axes, by name or by its components.
  DualVector3 vector(int body, const PointField& field, const std::string& where) const;
  // A point, measured from the centre of mass.
  DualVector3 point(int body, const PointField& field, const std::string& where) const;
  DualVector3 direction(int body, const std::optional<PointField>& field, const std::string& where) const;
  DualVector3 unit_axis(const DualVector3& axis, const std::string& where) const;

  // Index of a joint's angle among data.angles; made when it is first asked for.
  int angle_of(const std::string& joint, const std::string& where);

 private:
  std::map<std::size_t, int> angle_of_joint_;
};

void compile_bodies(Compilation& model);
void compile_joints(Compilation& model);
void compile_forces(Compilation& model);
void compile_user_forces(Compilation& model, std::vector<std::shared_ptr<const UserForce>> forces);
void compile_sensors(Compilation& model);
void compile_conditions(Compilation& model);  // after the sensors they are on

}  // namespace mbsopt
