#include "core/mechanism/compile.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>

#include "core/constraint/joints.hpp"
#include "core/mechanism/field_values.hpp"
#include "core/mechanism/mechanism.hpp"

namespace mbsopt {
namespace {

std::string at(const char* list, std::size_t i) { return std::string(list) + "[" + std::to_string(i) + "]"; }

class Compiler {
 public:
  Compiler(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active)
      : scene_(scene), fields_(scene, rho, active_list(rho, active)) {
    data_.rho = rho;
    data_.active = active_list(rho, active);
    data_.gravity = numbers(keep(data_.slot_gravity, fields_.values(scene.gravity, "gravity")));
  }

  MechanismData run(std::vector<std::shared_ptr<const UserForce>> user_forces) {
    add_bodies();
    for (std::size_t i = 0; i < scene_.joints.size(); ++i) add_joint(i);
    for (std::size_t i = 0; i < scene_.forces.size(); ++i) add_force(i);
    for (auto& force : user_forces) add_user_force(std::move(force));
    for (std::size_t i = 0; i < scene_.sensors.size(); ++i) {
      data_.sensors.push_back(sensor(scene_.sensors[i], at("sensors", i)));
      data_.sensor_names.push_back(scene_.sensors[i].name);
    }
    for (std::size_t i = 0; i < scene_.conditions.size(); ++i) add_condition(i);
    group_rows();
    scale_alpha();
    data_.theta_rho = fields_.theta_rho();
    return std::move(data_);
  }

 private:
  static std::vector<int> active_list(const Eigen::VectorXd& rho, const std::vector<bool>& active) {
    std::vector<int> list;
    for (int k = 0; k < rho.size(); ++k) {
      if (active.empty() || active.at(static_cast<std::size_t>(k))) list.push_back(k);
    }
    return list;
  }

  template <std::size_t N>
  const DualVector<N>& keep(int& slot, const DualVector<N>& x) {
    slot = fields_.slot(x);
    return x;
  }

  int body_index(const std::string& name, const std::string& where) const {
    for (std::size_t i = 0; i < data_.body_names.size(); ++i) {
      if (data_.body_names[i] == name) return static_cast<int>(i);
    }
    throw SceneError(where + ": there is no body '" + name + "'");
  }
  std::size_t joint_index(const std::string& name, const std::string& where) const {
    for (std::size_t i = 0; i < scene_.joints.size(); ++i) {
      if (scene_.joints[i].name == name) return i;
    }
    throw SceneError(where + ": there is no joint '" + name + "'");
  }

  // ------------------------------------------------------------------------------------------------------ bodies
  void add_bodies() {
    data_.n = static_cast<int>(scene_.bodies.size());
    if (data_.n == 0) throw SceneError("bodies: a scene needs at least one body besides the ground");
    data_.bodies.resize(scene_.bodies.size() + 1);
    data_.bodies[0].q << 0, 0, 0, 1, 0, 0, 0;
    data_.body_names = {"ground"};
    com_.resize(data_.bodies.size());
    for (Dual& c : com_[0]) c = fields_.constant(0);
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
      add_body(scene_.bodies[i], data_.bodies[i + 1], com_[i + 1], at("bodies", i));
      data_.body_names.push_back(scene_.bodies[i].name);
    }
  }

  void add_body(const Body& body, BodyData& out, DualVector3& com, const std::string& where) {
    const Dual mass = fields_.value(body.mass, where + ".mass");
    if (mass.value() < 0) throw SceneError(where + ".mass: is negative, a mass must not be");
    out.mass = mass.value();
    out.slot_mass = fields_.slot(mass);
    const InertiaField& I = body.inertia;
    const DualVector<6> J =
        fields_.values(std::array<Field, 6>{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}, where + ".inertia");
    const Vec<6> x = numbers(keep(out.slot_J, J));
    out.J << x(0), x(3), x(4), x(3), x(1), x(5), x(4), x(5), x(2);
    com = fields_.values(body.com, where + ".com");
    out.com = numbers(keep(out.slot_com, com));

    const DualVector4 p = orientation(body.orientation, where + ".orientation");
    const DualVector3 r = fields_.values(body.position, where + ".position") + rotated(p, com);
    const DualVector<7> q{r[0], r[1], r[2], p[0], p[1], p[2], p[3]};
    out.q = numbers(keep(out.slot_q, q));
    out.velocity = numbers(keep(out.slot_velocity, fields_.values(body.velocity, where + ".velocity")));
    out.angular_velocity =
        numbers(keep(out.slot_angular_velocity, fields_.values(body.angular_velocity, where + ".angular_velocity")));
  }

  DualVector4 orientation(const OrientationField& field, const std::string& where) const {
    if (const auto* e = std::get_if<EulerParametersField>(&field)) {
      const DualVector4 p = fields_.values(e->e, where);
      if (numbers(p).norm() == 0) throw SceneError(where + ": Euler parameters must not all be zero");
      return unit(p);
    }
    if (const auto* a = std::get_if<AxisAngleField>(&field)) {
      const DualVector3 axis = fields_.values(a->axis, where + ".axis");
      return euler_parameters(unit_axis(axis, where + ".axis"), fields_.value(a->angle, where + ".angle"));
    }
    const DualVector3 rpy = fields_.values(std::get<RollPitchYawField>(field).rpy, where + ".rpy");
    DualVector4 p = euler_parameters(unit_vector(2), rpy[2]);
    p = quaternion_product(p, euler_parameters(unit_vector(1), rpy[1]));
    return quaternion_product(p, euler_parameters(unit_vector(0), rpy[0]));
  }
  DualVector3 unit_vector(std::size_t k) const {
    DualVector3 e{fields_.constant(0), fields_.constant(0), fields_.constant(0)};
    e[k] = fields_.constant(1);
    return e;
  }
  static DualVector3 unit_axis(const DualVector3& axis, const std::string& where) {
    if (numbers(axis).norm() == 0) throw SceneError(where + ": is a zero vector, a direction must not be");
    return unit(axis);
  }

  // ------------------------------------------------------------------------------------- points and directions
  DualVector3 vector(int body, const PointField& field, const std::string& where) const {
    if (const auto* name = std::get_if<std::string>(&field)) {
      if (*name == "O") return {fields_.constant(0), fields_.constant(0), fields_.constant(0)};
      if (body > 0) {
        const auto& points = scene_.bodies[static_cast<std::size_t>(body - 1)].points;
        if (const auto found = points.find(*name); found != points.end()) {
          return fields_.values(found->second, at("bodies", static_cast<std::size_t>(body - 1)) + ".points." + *name);
        }
      }
      throw SceneError(where + ": body '" + data_.body_names[static_cast<std::size_t>(body)] + "' has no point '" +
                       *name + "'");
    }
    return fields_.values(std::get<VectorField>(field), where);
  }
  // A point measured from the centre of mass.
  DualVector3 point(int body, const PointField& field, const std::string& where) const {
    return vector(body, field, where) - com_[static_cast<std::size_t>(body)];
  }
  DualVector3 direction(int body, const std::optional<PointField>& field, const std::string& where) const {
    if (!field) throw SceneError(where + ": is missing; this joint needs it");
    return unit_axis(vector(body, *field, where), where);
  }

  // ------------------------------------------------------------------------------------------------------ joints
  void add_joint(std::size_t i) {
    const Joint& joint = scene_.joints[i];
    const std::string where = at("joints", i);
    data_.joint_names.push_back(joint.name);
    const JointRecipe* recipe = joint_recipe(joint.type);
    if (!recipe) throw SceneError(where + ".type: '" + joint.type + "' is not a joint known here");
    const int body1 = body_index(joint.body1, where + ".body1"), body2 = body_index(joint.body2, where + ".body2");
    if (body1 == body2) throw SceneError(where + ": joins body '" + joint.body1 + "' to itself");
    std::map<JointVector, DualVector3> vectors;
    auto of = [&](JointVector which) -> const DualVector3& {
      const auto found = vectors.find(which);
      if (found != vectors.end()) return found->second;
      DualVector3 x;
      switch (which) {
        case JointVector::point1:
          x = point(body1, joint.point1, where + ".point1");
          break;
        case JointVector::point2:
          x = point(body2, joint.point2, where + ".point2");
          break;
        case JointVector::axis2:
          x = direction(body2, joint.axis2, where + ".axis2");
          break;
        case JointVector::normal1:
          x = perpendicular(direction(body1, joint.axis1, where + ".axis1"));
          break;
        case JointVector::binormal1: {
          const DualVector3 a = direction(body1, joint.axis1, where + ".axis1");
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
      c.row = data_.m;
      c.primitive = equation.primitive;
      std::visit(
          [&](auto& p) {
            p.s1 = numbers(keep(c.slot1, of(equation.s1)));
            p.s2 = numbers(keep(c.slot2, of(equation.s2)));
          },
          c.primitive);
      data_.m += c.rows();
      data_.constraints.push_back(c);
    }
  }

  int angle_of(const std::string& name, const std::string& where) {
    const std::size_t i = joint_index(name, where);
    if (const auto found = angle_of_joint_.find(i); found != angle_of_joint_.end()) return found->second;
    const Joint& joint = scene_.joints[i];
    const std::string joint_path = at("joints", i);
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
    data_.angles.push_back(angle);
    return angle_of_joint_[i] = static_cast<int>(data_.angles.size()) - 1;
  }

  // ------------------------------------------------------------------------------------------------------ forces
  Law law(const std::optional<Expression>& expression, const std::array<const char*, 2>& variables,
          const std::array<Field, 4>& coefficients, const std::string& where) {
    Law result;
    if (expression) {
      Symbols symbols = fields_.symbols();
      for (const char* name : variables) symbols.add_input(name);
      symbols.add_input("t");
      try {
        result.program.emplace(*expression, symbols);
      } catch (const UnknownName& e) {
        throw SceneError(where + ".law: " + e.what());
      }
      data_.largest_law = std::max(data_.largest_law, symbols.inputs());
      return result;
    }
    const DualVector<4> x = fields_.values(coefficients, where);
    const Vec<4> v = numbers(keep(result.slot, x));
    result.k = v(0), result.c = v(1), result.x0 = v(2), result.f0 = v(3);
    return result;
  }

  void add_force(std::size_t i) {
    const Force& force = scene_.forces[i];
    const std::string where = at("forces", i);
    if (const auto* f = std::get_if<Tsda>(&force.kind)) {
      TsdaForce out;
      out.force = static_cast<int>(i);
      out.body1 = body_index(f->body1, where + ".body1"), out.body2 = body_index(f->body2, where + ".body2");
      out.s1 = numbers(keep(out.slot1, point(out.body1, f->point1, where + ".point1")));
      out.s2 = numbers(keep(out.slot2, point(out.body2, f->point2, where + ".point2")));
      out.law = law(f->law, {"l", "ldot"}, {f->stiffness, f->damping, f->free_length, f->actuator}, where);
      data_.tsda.push_back(std::move(out));
    } else {
      const Rsda& r = std::get<Rsda>(force.kind);
      RsdaForce out;
      out.force = static_cast<int>(i);
      out.joint_angle = angle_of(r.joint, where + ".joint");
      out.law = law(r.law, {"angle", "rate"}, {r.stiffness, r.damping, r.free_angle, 0.0}, where);
      data_.rsda.push_back(std::move(out));
    }
  }

  void add_user_force(std::shared_ptr<const UserForce> force) {
    UserForceData out;
    for (const std::string& name : force->bodies()) {
      const int body = body_index(name, "user force");
      if (body == 0) throw SceneError("user force: acts on the ground, which never moves");
      out.bodies.push_back(body);
    }
    out.force = std::move(force);
    data_.user_forces.push_back(std::move(out));
  }

  // ----------------------------------------------------------------------------------------------------- sensors
  PointSensor::Point sensor_point(const std::string& body, const PointField& field, const std::string& where) {
    PointSensor::Point result;
    result.body = body_index(body, where);
    result.s = numbers(keep(result.slot, point(result.body, field, where)));
    return result;
  }

  static int component(const std::string& name, const std::string& where) {
    constexpr std::array<const char*, 4> names{"x", "y", "z", "norm"};
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) throw SceneError(where + ".component: is '" + name + "'; allowed: x, y, z, norm");
    return static_cast<int>(found - names.begin());
  }

  SensorKind sensor(const Sensor& s, const std::string& where) {
    const std::string& quantity = s.quantity;
    if (quantity == "position" || quantity == "velocity") {
      PointSensor out;
      out.quantity = quantity == "position" ? PointSensor::Quantity::position : PointSensor::Quantity::velocity;
      out.a = sensor_point(s.body, s.point, where);
      if (s.relative_to) {
        out.relative = true;
        out.b = sensor_point(s.relative_to->body, s.relative_to->point, where + ".relative_to");
      }
      out.component = component(s.component, where);
      if (s.in_body_frame && out.a.body > 0) out.axes_body = out.a.body;
      return out;
    }
    if (quantity == "distance" || quantity == "distance_rate") {
      PointSensor out;
      out.quantity = quantity == "distance" ? PointSensor::Quantity::position : PointSensor::Quantity::position_rate;
      out.component = PointSensor::kNorm;
      out.relative = true;
      out.a = sensor_point(s.body2, s.point2, where);
      out.b = sensor_point(s.body1.empty() ? "ground" : s.body1, s.point1, where);
      return out;
    }
    if (quantity == "angle" || quantity == "rate") {
      return AngleSensor{angle_of(s.joint, where + ".joint"), quantity == "rate"};
    }
    if (quantity == "angular_velocity") {
      return AngularVelocitySensor{body_index(s.body, where), component(s.component, where), s.in_body_frame};
    }
    if (quantity == "orientation") {
      const int body = body_index(s.body, where);
      if (body == 0 || s.component.size() != 2 || s.component[0] != 'e' || s.component[1] < '0' ||
          s.component[1] > '3') {
        throw SceneError(where + ": orientation needs a moving body and a component e0, e1, e2 or e3");
      }
      return CoordinateSensor{7 * (body - 1) + 3 + (s.component[1] - '0')};
    }
    if (quantity == "energy") {
      if (s.component != "kinetic" && s.component != "potential" && s.component != "total") {
        throw SceneError(where + ".component: is '" + s.component + "'; allowed: kinetic, potential, total");
      }
      return EnergySensor{s.component != "potential", s.component != "kinetic"};
    }
    if (quantity == "constraint_violation") return ViolationSensor{};
    throw SceneError(where + ".quantity: '" + quantity + "' is not a quantity known here");
  }

  void add_condition(std::size_t i) {
    const Condition& c = scene_.conditions[i];
    const std::string where = std::string("initial.") + at("conditions", i);
    ConditionData out;
    const auto found = std::find(data_.sensor_names.begin(), data_.sensor_names.end(), c.sensor);
    if (found == data_.sensor_names.end()) throw SceneError(where + ".sensor: there is no sensor '" + c.sensor + "'");
    out.sensor = static_cast<int>(found - data_.sensor_names.begin());
    const SensorKind& kind = data_.sensors[static_cast<std::size_t>(out.sensor)];
    const bool has_rate = rate_of(kind, out.rate_kind);
    if (const auto* p = std::get_if<PointSensor>(&kind)) {
      out.velocity_level = p->quantity != PointSensor::Quantity::position;
    } else if (const auto* a = std::get_if<AngleSensor>(&kind)) {
      out.velocity_level = a->rate;
      out.modulo_turn = !a->rate;
    } else {
      out.velocity_level = !std::holds_alternative<CoordinateSensor>(kind);
    }
    if (std::holds_alternative<EnergySensor>(kind) || std::holds_alternative<ViolationSensor>(kind)) {
      throw SceneError(where + ": a condition on sensor '" + c.sensor +
                       "' is not possible; use positions, velocities, "
                       "angles, distances, their rates, angular velocities or Euler parameters");
    }
    if (c.value) {
      const Dual v = fields_.value(*c.value, where + ".value");
      out.has_value = true, out.value = v.value(), out.slot_value = fields_.slot(v);
    }
    if (c.rate) {
      if (out.velocity_level)
        throw SceneError(where + ".rate: sensor '" + c.sensor + "' is a velocity: give its value");
      if (!has_rate) throw SceneError(where + ".rate: the rate of sensor '" + c.sensor + "' is not available");
      const Dual v = fields_.value(*c.rate, where + ".rate");
      out.has_rate = true, out.rate = v.value(), out.slot_rate = fields_.slot(v);
    }
    data_.conditions.push_back(out);
  }

  // The time derivative of a position-level sensor as a sensor of its own, where it is one.
  bool rate_of(const SensorKind& kind, SensorKind& rate) const {
    if (const auto* p = std::get_if<PointSensor>(&kind)) {
      if (p->quantity != PointSensor::Quantity::position) return false;
      PointSensor r = *p;
      r.quantity = PointSensor::Quantity::position_rate;
      rate = r;
      return true;
    }
    if (const auto* a = std::get_if<AngleSensor>(&kind); a && !a->rate) {
      rate = AngleSensor{a->angle, true};
      return true;
    }
    if (const auto* c = std::get_if<CoordinateSensor>(&kind)) {
      rate = CoordinateSensor{c->index + 7 * data_.n};
      return true;
    }
    return false;
  }

  // ------------------------------------------------------------------------------------------------ rows and alpha
  void group_rows() {
    for (const Constraint& c : data_.constraints) {
      if (data_.groups.empty() || data_.groups.back().body1 != c.body1 || data_.groups.back().body2 != c.body2) {
        data_.groups.push_back({c.body1, c.body2, c.row, 0});
      }
      data_.groups.back().rows += c.rows();
    }
  }

  // The inertia a constraint sees, independent of the configuration: reduced mass of the two bodies for a point,
  // reduced inertia about the body's farthest joint point for a direction. Bodies without mass count with a small share
  // of the largest mass, so that alpha stays finite and S = M + alpha J'J stays well scaled.
  void scale_alpha() {
    const std::size_t bodies = data_.bodies.size();
    std::vector<double> mass(bodies), inertia(bodies), reach2(bodies, 0.0);
    double largest_mass = 0, largest_inertia = 0;
    for (const Constraint& c : data_.constraints) {
      if (const auto* p = std::get_if<Coincidence>(&c.primitive)) {
        double& r1 = reach2[static_cast<std::size_t>(c.body1)];
        double& r2 = reach2[static_cast<std::size_t>(c.body2)];
        r1 = std::max(r1, p->s1.squaredNorm());
        r2 = std::max(r2, p->s2.squaredNorm());
      }
    }
    for (std::size_t i = 1; i < bodies; ++i) {
      const BodyData& b = data_.bodies[i];
      mass[i] = b.mass;
      inertia[i] =
          Eigen::SelfAdjointEigenSolver<Matrix3d>(b.J, Eigen::EigenvaluesOnly).eigenvalues()(2) + b.mass * reach2[i];
      largest_mass = std::max(largest_mass, mass[i]);
      largest_inertia = std::max(largest_inertia, inertia[i]);
    }
    if (largest_mass == 0) largest_mass = 1;
    if (largest_inertia == 0) largest_inertia = 1;
    constexpr double kLeast = 1e-10;
    auto inverse = [&](const std::vector<double>& x, double largest, int body) {
      return body == 0 ? 0.0 : 1 / std::max(x[static_cast<std::size_t>(body)], kLeast * largest);
    };
    for (Constraint& c : data_.constraints) {
      c.alpha = std::holds_alternative<Coincidence>(c.primitive)
                    ? 1 / (inverse(mass, largest_mass, c.body1) + inverse(mass, largest_mass, c.body2))
                    : 1 / (inverse(inertia, largest_inertia, c.body1) + inverse(inertia, largest_inertia, c.body2));
    }
  }

  const Scene& scene_;
  FieldValues fields_;
  MechanismData data_;
  std::vector<DualVector3> com_;
  std::map<std::size_t, int> angle_of_joint_;
};

}  // namespace

MechanismData compile(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                      std::vector<std::shared_ptr<const UserForce>> user_forces) {
  if (rho.size() != static_cast<Eigen::Index>(scene.parameters.size())) {
    throw SceneError("parameters: " + std::to_string(rho.size()) + " values were given for " +
                     std::to_string(scene.parameters.size()) + " parameters");
  }
  return Compiler(scene, rho, active).run(std::move(user_forces));
}

}  // namespace mbsopt
