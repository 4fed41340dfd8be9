// Joints: each becomes the primitives of its recipe; and the angles of those whose angle is used.
#include "core/constraint/joints.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

void add_joint(Compilation& model, std::size_t i) {
  const Joint& joint = model.scene.joints[i];
  const std::string where = child_path("joints", i);
  model.data.joint_names.push_back(joint.name);
  const JointRecipe* recipe = joint_recipe(joint.type);
  if (!recipe) throw SceneError(where + ".type: '" + joint.type + "' is not a joint known here");
  const int body1 = model.body_index(joint.body1, where + ".body1"),
            body2 = model.body_index(joint.body2, where + ".body2");
  if (body1 == body2) throw SceneError(where + ": joins body '" + joint.body1 + "' to itself");
  std::map<JointVector, DualVector3> vectors;
  auto of = [&](JointVector which) -> const DualVector3& {
    const auto found = vectors.find(which);
    if (found != vectors.end()) return found->second;
    DualVector3 x;
    switch (which) {
      case JointVector::point1:
        x = model.point(body1, joint.point1, where + ".point1");
        break;
      case JointVector::point2:
        x = model.point(body2, joint.point2, where + ".point2");
        break;
      case JointVector::axis2:
        x = model.direction(body2, joint.axis2, where + ".axis2");
        break;
      case JointVector::normal1:
        x = perpendicular(model.direction(body1, joint.axis1, where + ".axis1"));
        break;
      case JointVector::binormal1: {
        const DualVector3 a = model.direction(body1, joint.axis1, where + ".axis1");
        x = cross(a, perpendicular(a));
        break;
      }
    }
    return vectors.emplace(which, x).first->second;
  };
  for (const JointEquation& equation : recipe->equations) {
    Constraint c;
    c.joint = static_cast<int>(i);
    c.body1 = body1, c.body2 = body2;
    c.row = model.data.m;
    c.primitive = equation.primitive;
    std::visit(
        [&](auto& p) {
          p.s1 = numbers(model.keep(c.slot1, of(equation.s1)));
          p.s2 = numbers(model.keep(c.slot2, of(equation.s2)));
        },
        c.primitive);
    model.data.m += c.rows();
    model.data.constraints.push_back(c);
  }
}

}  // namespace

void compile_joints(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.joints.size(); ++i) add_joint(model, i);
}

int Compilation::angle_of(const std::string& name, const std::string& where) {
  const std::size_t i = joint_index(name, where);
  if (const auto found = angle_of_joint_.find(i); found != angle_of_joint_.end()) return found->second;
  const Joint& joint = scene.joints[i];
  const std::string joint_path = child_path("joints", i);
  if (joint.type != "revolute") {
    throw SceneError(where + ": joint '" + name + "' is " + joint.type + "; an angle needs a revolute joint");
  }
  JointAngle angle;
  angle.joint = static_cast<int>(i);
  angle.body1 = body_index(joint.body1, joint_path), angle.body2 = body_index(joint.body2, joint_path);
  const DualVector3 a1 = direction(angle.body1, joint.axis1, joint_path + ".axis1");
  const DualVector3 a2 = direction(angle.body2, joint.axis2, joint_path + ".axis2");
  DualVector3 n1, n2;
  if (joint.normal1 && joint.normal2) {
    n1 = perpendicular_part(direction(angle.body1, joint.normal1, joint_path + ".normal1"), a1);
    n2 = perpendicular_part(direction(angle.body2, joint.normal2, joint_path + ".normal2"), a2);
    if (!numbers(n1).allFinite() || !numbers(n2).allFinite()) {
      throw SceneError(joint_path + ": a normal is parallel to its axis; it must have a part perpendicular to it");
    }
  } else {
    if (joint.normal1 || joint.normal2) throw SceneError(joint_path + ": give both normal1 and normal2, or neither");
    if ((numbers(a1) - numbers(a2)).norm() > 1e-12) {
      throw SceneError(joint_path + ": its angle is used and axis1 differs from axis2: give normal1 and normal2");
    }
    n1 = perpendicular(a1);
    n2 = perpendicular(a2);
  }
  angle.x1 = numbers(keep(angle.slot_x1, n1));
  angle.y1 = numbers(keep(angle.slot_y1, cross(a1, n1)));
  angle.n2 = numbers(keep(angle.slot_n2, n2));
  data.angles.push_back(angle);
  return angle_of_joint_[i] = static_cast<int>(data.angles.size()) - 1;
}

}  // namespace mbsopt
