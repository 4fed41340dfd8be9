// Joints: each becomes the primitives of its recipe. Gears, racks and screws tie angles and displacements of joints.
#include <numbers>

#include "core/constraint/joints.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {
namespace {

// The vectors of a joint; each is computed when an equation needs it.
class JointVectors {
 public:
  JointVectors(Compilation& model, const Joint& joint, int body1, int body2, std::string where)
      : model_(model), joint_(joint), body1_(body1), body2_(body2), where_(std::move(where)) {}

  const FieldVector3& operator()(JointVector which) {
    const auto found = vectors_.find(which);
    return found != vectors_.end() ? found->second : vectors_.emplace(which, make(which)).first->second;
  }

 private:
  FieldVector3 make(JointVector which) {
    switch (which) {
      case JointVector::none:
        break;
      case JointVector::point1:
        return model_.point(body1_, joint_.point1, where_ + ".point1");
      case JointVector::point2:
        return model_.point(body2_, joint_.point2, where_ + ".point2");
      case JointVector::axis1:
        return model_.direction(body1_, joint_.axis1, where_ + ".axis1");
      case JointVector::axis2:
        return model_.direction(body2_, joint_.axis2, where_ + ".axis2");
      case JointVector::across1:
        return perpendicular((*this)(JointVector::axis1));
      case JointVector::binormal1:
        return cross((*this)(JointVector::axis1), (*this)(JointVector::across1));
      case JointVector::keep1:
        return joint_.normal1 ? normal(body1_, joint_.normal1, JointVector::axis1, ".normal1")
                              : (*this)(JointVector::across1);
      case JointVector::keep2:
        return cross((*this)(JointVector::axis2), second_normal());
      case JointVector::x1:
        return global_axis(body1_, 0);
      case JointVector::y1:
        return global_axis(body1_, 1);
      case JointVector::y2:
        return global_axis(body2_, 1);
      case JointVector::z2:
        return global_axis(body2_, 2);
    }
    return {};
  }

  FieldVector3 normal(int body, const std::optional<PointField>& field, JointVector axis, const char* key) {
    const FieldVector3 n = perpendicular_part(model_.direction(body, field, where_ + key), (*this)(axis));
    if (!numbers(n).allFinite()) throw SceneError(where_ + key + ": is parallel to the axis");
    return n;
  }
  // Returns normal2. If the file omits it, this is the first normal as body 2 sees it in the file.
  FieldVector3 second_normal() {
    if (joint_.normal2) return normal(body2_, joint_.normal2, JointVector::axis2, ".normal2");
    const FieldVector3 n =
        model_.normal_in_file(body1_, (*this)(JointVector::keep1), body2_, (*this)(JointVector::axis2));
    if (!numbers(n).allFinite()) {
      throw SceneError(where_ +
                       ": the bodies' orientations in the file have axis1 and axis2 at right angles, so that the "
                       "rotation about the axis cannot be taken from them: give normal1 and normal2");
    }
    return n;
  }
  FieldVector3 global_axis(int body, Eigen::Index k) const {
    return rotated(inverse(model_.orientation[at(body)]), model_.fields.constants(Vector3d::Unit(k)));
  }

  Compilation& model_;
  const Joint& joint_;
  int body1_, body2_;
  std::string where_;
  std::map<JointVector, FieldVector3> vectors_;
};

void set_vectors(Compilation& model, Constraint& c, JointVectors& of, JointVector s1, JointVector s2, JointVector s3) {
  std::visit(
      [&](auto& p) {
        if constexpr (requires { p.s1; }) {
          p.s1 = numbers(model.keep(c.slot1, of(s1)));
          p.s2 = numbers(model.keep(c.slot2, of(s2)));
        }
        if constexpr (requires { p.s3; }) p.s3 = numbers(model.keep(c.slot3, of(s3)));
      },
      c.primitive);
}

void add_constant(Compilation& model, int row, const FieldValue& value) {
  model.data.laws.push_back({row, {value.value(), model.fields.slot(value), nullptr}});
}

template <class P>
Constraint term_of(const JointMeasure<P>& joint) {
  return {joint, joint.measure};
}

// Phi = second - factor * first - constant
void tie(Compilation& model, int joint, Constraint second, Constraint first, const FieldValue& factor,
         const FieldValue& constant) {
  second.joint = first.joint = joint;
  first.row = model.add_constraint(std::move(second));
  first.factor = -factor.value();
  first.slot_factor = model.fields.slot(-factor);
  if (constant.value() != 0 || !constant.derivatives().isZero(0)) add_constant(model, first.row, constant);
  model.data.constraints.push_back(std::move(first));
}

void add_joint(Compilation& model, std::size_t i) {
  const Joint& joint = model.scene.joints[i];
  const std::string where = child_path("joints", i);
  model.data.joint_names.push_back(joint.name);
  const JointRecipe* recipe = joint_recipe(joint.type);
  if (!recipe) throw SceneError(where + ".type: '" + joint.type + "' is not a joint known here");
  if (ties_joints(joint)) return;  // after the joints that it ties
  const int body1 = model.body_index(joint.body1, where + ".body1"),
            body2 = model.body_index(joint.body2, where + ".body2");
  if (body1 == body2) throw SceneError(where + ": joins body '" + joint.body1 + "' to itself");
  JointVectors vectors(model, joint, body1, body2, where);
  for (const JointEquation& equation : recipe->equations) {
    Constraint c;
    c.joint = static_cast<int>(i);
    c.body1 = body1;
    c.body2 = body2;
    c.primitive = equation.primitive;
    set_vectors(model, c, vectors, equation.s1, equation.s2, equation.s3);
    model.add_constraint(std::move(c));
  }
  if (joint.type == "distance") {
    add_constant(model, model.data.m - 1, model.fields.value(joint.length, where + ".length"));
  } else if (joint.type == "screw") {
    tie(model, static_cast<int>(i), model.joint_displacement_term(joint.name, where),
        model.joint_angle_term(joint.name, Compilation::Zero::start, where),
        model.fields.value(joint.pitch, where + ".pitch") / (2 * std::numbers::pi),
        model.joint_displacement_in_file(joint.name, where));
  }
}

void add_tie(Compilation& model, std::size_t i) {
  const Joint& joint = model.scene.joints[i];
  const std::string where = child_path("joints", i);
  using enum Compilation::Zero;
  const Constraint first = model.joint_angle_term(joint.joint1, start, where + ".joint1");
  if (joint.type == "gear") {
    tie(model, static_cast<int>(i), model.joint_angle_term(joint.joint2, start, where + ".joint2"), first,
        model.fields.value(joint.ratio, where + ".ratio"), model.fields.constant(0));
  } else {
    tie(model, static_cast<int>(i), model.joint_displacement_term(joint.joint2, where + ".joint2"), first,
        model.fields.value(joint.radius, where + ".radius"),
        model.joint_displacement_in_file(joint.joint2, where + ".joint2"));
  }
}

}  // namespace

void compile_joints(Compilation& model) {
  for (std::size_t i = 0; i < model.scene.joints.size(); ++i) add_joint(model, i);
  for (std::size_t i = 0; i < model.scene.joints.size(); ++i) {
    if (ties_joints(model.scene.joints[i])) add_tie(model, i);
  }
}

FieldVector3 Compilation::normal_in_file(int body1, const FieldVector3& normal1, int body2,
                                         const FieldVector3& axis2) const {
  const FieldVector3 global = rotated(orientation[at(body1)], normal1);
  return perpendicular_part(rotated(inverse(orientation[at(body2)]), global), axis2);
}

int Compilation::add_constraint(Constraint c) {
  c.row = data.m;
  data.m += c.rows();
  data.constraints.push_back(std::move(c));
  return data.constraints.back().row;
}

Constraint Compilation::joint_angle_term(const std::string& name, Zero zero, const std::string& where) {
  const int angle = angle_of(name, where, zero);
  Constraint c = term_of(data.angles[at(angle)]);
  c.angle = angle;
  return c;
}

Constraint Compilation::joint_displacement_term(const std::string& name, const std::string& where) {
  return term_of(joint_displacement(name, where));
}

JointDisplacement Compilation::joint_displacement(const std::string& name, const std::string& where) {
  const Joint& joint = scene.joints[joint_index(name, where)];
  const JointRecipe* recipe = joint_recipe(joint.type);
  if (!recipe || !recipe->has_displacement) {
    throw SceneError(where + ": joint '" + name + "' is " + joint.type + " and has no displacement");
  }
  const std::string path = child_path("joints", joint_index(name, where));
  JointDisplacement x;
  x.body1 = body_index(joint.body1, path);
  x.body2 = body_index(joint.body2, path);
  JointVectors vectors(*this, joint, x.body1, x.body2, path);
  x.measure.s1 = numbers(keep(x.slot1, vectors(JointVector::point1)));
  x.measure.s2 = numbers(keep(x.slot2, vectors(JointVector::point2)));
  x.measure.s3 = numbers(keep(x.slot3, vectors(JointVector::axis1)));
  return x;
}

FieldValue Compilation::joint_displacement_in_file(const std::string& name, const std::string& where) const {
  const Joint& joint = scene.joints[joint_index(name, where)];
  const std::string path = child_path("joints", joint_index(name, where));
  const std::size_t b1 = at(body_index(joint.body1, path)), b2 = at(body_index(joint.body2, path));
  auto global = [&](std::size_t body, const PointField& p, const char* key) {
    return position[body] + rotated(orientation[body], point(static_cast<int>(body), p, path + key));
  };
  const FieldVector3 axis = rotated(orientation[b1], direction(static_cast<int>(b1), joint.axis1, path + ".axis1"));
  return dot(axis, global(b2, joint.point2, ".point2") - global(b1, joint.point1, ".point1"));
}

int Compilation::angle_of(const std::string& name, const std::string& where, Zero zero) {
  const std::size_t i = joint_index(name, where);
  if (scene.joints[i].normal1 && scene.joints[i].normal2) zero = Zero::normals;
  if (const auto found = angle_of_joint_.find({i, zero}); found != angle_of_joint_.end()) return found->second;
  const Joint& joint = scene.joints[i];
  const std::string joint_path = child_path("joints", i);
  const JointRecipe* recipe = joint_recipe(joint.type);
  if (!recipe || !recipe->has_angle) {
    throw SceneError(where + ": joint '" + name + "' is " + joint.type + " and has no angle");
  }
  const int body1 = body_index(joint.body1, joint_path), body2 = body_index(joint.body2, joint_path);
  const FieldVector3 a1 = direction(body1, joint.axis1, joint_path + ".axis1");
  const FieldVector3 a2 = direction(body2, joint.axis2, joint_path + ".axis2");
  FieldVector3 n1, n2;
  if (joint.normal1 && joint.normal2) {
    n1 = perpendicular_part(direction(body1, joint.normal1, joint_path + ".normal1"), a1);
    n2 = perpendicular_part(direction(body2, joint.normal2, joint_path + ".normal2"), a2);
    if (!numbers(n1).allFinite() || !numbers(n2).allFinite()) {
      throw SceneError(joint_path + ": a normal is parallel to its axis; it must have a part perpendicular to it");
    }
  } else {
    if (joint.normal1 || joint.normal2) throw SceneError(joint_path + ": give both normal1 and normal2, or neither");
    if (zero == Zero::normals && (numbers(a1) - numbers(a2)).norm() > 1e-12) {
      throw SceneError(
          joint_path +
          ": its angle is used and axis1 differs from axis2: make them equal, or give normal1 and normal2");
    }
    for (std::size_t k = 0; k < 3 && zero == Zero::normals; ++k) {
      constexpr double kSame = 1e-12;
      if ((a1[k].derivatives() - a2[k].derivatives()).norm() <= kSame) continue;
      throw SceneError(joint_path +
                       ": its angle is used, and a parameter turns axis1 away from axis2: give normal1 and normal2");
    }
    n1 = perpendicular(a1);
    n2 = zero == Zero::normals ? perpendicular(a2) : normal_in_file(body1, n1, body2, a2);
    if (!numbers(n2).allFinite()) {
      throw SceneError(joint_path +
                       ": its axes are at right angles in the file, so that its angle from the start is "
                       "not settled: give normal1 and normal2");
    }
  }
  return angle_of_joint_[{i, zero}] = add_angle(body1, body2, a1, n1, n2);
}

int Compilation::angle_about(int body1, int body2, const std::optional<PointField>& axis, const std::string& where) {
  const FieldVector3 a = direction(body1, axis, where + ".axis"), n = perpendicular(a);
  return add_angle(body1, body2, a, n, n);
}

int Compilation::add_angle(int body1, int body2, const FieldVector3& a1, const FieldVector3& n1,
                           const FieldVector3& n2) {
  JointAngle angle{{body1, body2}, {}};
  angle.measure.s1 = numbers(keep(angle.slot1, n1));
  angle.measure.s3 = numbers(keep(angle.slot3, cross(a1, n1)));
  angle.measure.s2 = numbers(keep(angle.slot2, n2));
  data.angles.push_back(angle);
  return static_cast<int>(data.angles.size()) - 1;
}

}  // namespace mbsopt
