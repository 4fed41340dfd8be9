// The readers of URDF and MJCF add bodies, joints and ties by this, with findings of what a problem file cannot have.
#pragma once

#include <map>
#include <string>

#include "app/import/imported_model.hpp"

namespace mbsopt::inline app {

// A rotation about a coordinate axis, 0 to 2.
inline Eigen::Matrix3d rotation(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
}

class ModelBuilder {
 protected:
  ModelBuilder(ModelFile& file, std::vector<ModelAttribute> table);

  ImportedBody& body(int index) { return model_.bodies[static_cast<std::size_t>(index)]; }

  // `between` is the frame of the new body in that of its parent. Returns the index of the body.
  int add_body(const std::string& name, int parent, const Eigen::Isometry3d& between, const ModelElement& source);

  // The parts of a body add up. An impossible mass or inertia is a finding.
  //   m = m1 + m2,  com = (m1 c1 + m2 c2)/m,  J = J1 + J2 + m1 m2/m (d'd I - d d'),  d = c2 - c1   (Huygens, Steiner)
  void add_part(ImportedBody& body, double mass, const Eigen::Vector3d& com, const Eigen::Matrix3d& inertia,
                const ModelElement& source);

  // A joint without a type of the problem format leaves its body free. Resistance that a problem file cannot give a
  // joint of its type is left out, with a sentence; `resistance` is its element, and `given` the type in the file.
  void add_joint(const std::string& name, ImportedJoint joint, const ModelElement& source,
                 const ModelElement& resistance, const std::string& given);

  // By the names of joints in the file. `how` goes between them in the name of the tie.
  void add_tie(const std::string& driven, const std::string& how, const std::string& driver, double factor,
               const ModelElement& source);

  // Throws InputError with every finding.
  ImportedModel finished();

  ModelFile& file_;
  ModelElement root_ = file_.root();
  ImportedModel model_;
  std::map<std::string, int> joint_index_;  // by the names of the file

 private:
  UniqueNames body_names_{UniqueNames::Kind::name, {"ground"}, &model_.changed};
  UniqueNames joint_names_{UniqueNames::Kind::name, {}, &model_.changed};
};

}  // namespace mbsopt::inline app
