#include "core/scene/type_table.hpp"

#include <algorithm>

#include "core/expression/did_you_mean.hpp"
#include "core/scene/scene.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

namespace {

constexpr TypeRow kJoints[] = {
    {"revolute", "a common point and a common axis: 5 equations", "point1 point2 axis1! axis2! normal1 normal2"},
    {"spherical", "a common point: 3 equations", "point1 point2"},
    {"translational", "slides along a common axis without turning: 5 equations",
     "point1 point2 axis1! axis2! normal1 normal2"},
    {"cylindrical", "slides along a common axis and turns about it: 4 equations",
     "point1 point2 axis1! axis2! normal1 normal2"},
    {"screw", "a cylindrical joint whose displacement from the start is pitch/(2 pi) times its angle: 5 equations",
     "point1 point2 axis1! axis2! normal1 normal2 pitch!"},
    {"universal", "a common point and two axes that stay perpendicular: 4 equations", "point1 point2 axis1! axis2!"},
    {"planar", "a plane of each body stays in the other's, axis1 and axis2 the normals: 3 equations",
     "point1 point2 axis1! axis2!"},
    {"fixed", "keeps the relative position and orientation that the bodies have in the file: 6 equations",
     "point1 point2"},
    {"distance", "a massless rod of given length between two points: 1 equation", "point1 point2 length!"},
    {"point_on_line", "point2 stays on the line through point1 along axis1: 2 equations", "point1 point2 axis1!"},
    {"point_on_plane", "point2 stays in the plane through point1 with the normal axis1: 1 equation",
     "point1 point2 axis1!"},
    {"perpendicular", "axis1 and axis2 stay perpendicular: 1 equation", "axis1! axis2!"},
    {"gear", "angle(joint2) = ratio angle(joint1) from the start: 1 equation", "joint1! joint2! ratio!"},
    {"rack_pinion", "displacement(joint2) = radius angle(joint1) from the start: 1 equation",
     "joint1! joint2! radius!"},
};

constexpr TypeRow kDrives[] = {
    {"coordinate", "a coordinate of a body: of its centre of mass, or an Euler parameter", "body! coordinate!"},
    {"distance", "the distance of two points", "body1 body2! point1 point2"},
    {"angle", "the angle of a revolute, cylindrical or screw joint", "joint!"},
    {"displacement", "the displacement along a translational, cylindrical or screw joint", "joint!"},
};

constexpr TypeRow kForces[] = {
    {"tsda", "spring, damper and actuator between two points: k (l - l0) + c ldot + actuator, or a law",
     "body1 body2! point1 point2 stiffness damping free_length actuator law"},
    {"rsda", "torsional spring and damper on a joint's angle: k (angle - angle0) + c rate, or a law",
     "joint! stiffness damping free_angle law"},
    {"torsion_bar", "torsional spring and damper between two bodies, on their angle about an axis fixed in body1",
     "body1 body2! axis! stiffness damping free_angle law"},
    {"force", "force on a point of a body: three expressions of t, parameters and sensors of the state",
     "body! point components! frame"},
    {"torque", "torque on a body: three expressions of t, parameters and sensors of the state",
     "body! components! frame"},
    {"bushing", "springs and dampers along and about the three axes of body1, undeformed as the file places the bodies",
     "body1 body2! point1 point2 stiffness damping torsional_stiffness torsional_damping"},
    {"friction", "smoothed Coulomb, Stribeck and viscous friction about or along the axis of a joint",
     "joint! motion coulomb smooth_velocity! viscous breakaway stribeck_velocity"},
    {"stop", "one-sided spring on a joint's angle or displacement beyond a bound: k d^n (1 + a ddot), never negative",
     "joint! motion lower upper stiffness! exponent damping"},
    {"contact",
     "one-sided spring k d^n (1 + a ddot), never negative, between a ball and a plane, a ball, or the inside of a ring",
     "body1 body2! point1 point2 normal1 radius1 radius2 inside stiffness! exponent damping"},
    {"user", "force written in C++, of a plug-in or of the program, by its name", "force! bodies parameters"},
};

constexpr TypeRow kQuantities[] = {
    {"position", "of a body point", "body! point relative_to component! frame", "x y z norm", dimension::kLength},
    {"velocity", "of a body point", "body! point relative_to component! frame", "x y z norm", dimension::kVelocity,
     Reads::velocities},
    {"angle", "of a revolute, cylindrical or screw joint, continuous over many turns", "joint!", "", dimension::kAngle},
    {"rate", "time derivative of a joint's angle", "joint!", "", dimension::kRate, Reads::velocities},
    {"body_angle",
     "of a body about an axis fixed in the ground, 0 as the body's axes lie along the ground's, continuous",
     "body! axis!", "", dimension::kAngle},
    {"relative_angle",
     "of body2 from body1 about an axis fixed in body1, 0 as their axes lie along each other, continuous",
     "body1 body2! axis!", "", dimension::kAngle},
    {"displacement", "along the axis of a translational, cylindrical or screw joint", "joint!", "", dimension::kLength},
    {"distance", "of two body points", "body1 body2! point1 point2", "", dimension::kLength},
    {"distance_rate", "time derivative of a distance", "body1 body2! point1 point2", "", dimension::kVelocity,
     Reads::velocities},
    {"angular_velocity", "of a body", "body! component! frame", "x y z norm", dimension::kRate, Reads::velocities},
    {"orientation", "Euler parameters of a body", "body! component!", "e0 e1 e2 e3"},
    {"energy", "of the whole mechanism", "component!", "kinetic potential total", dimension::kTorque, Reads::state,
     "J"},
    {"centre_of_mass", "common one of all bodies", "component!", "x y z norm", dimension::kLength},
    {"momentum", "linear, of all bodies together", "component!", "x y z norm", Dimension{{1, 1, -1, 0}},
     Reads::velocities, "kg m/s"},
    {"angular_momentum", "of all bodies together about the global origin", "component!", "x y z norm",
     Dimension{{2, 1, -1, 0}}, Reads::velocities, "kg m^2/s"},
    {"constraint_violation", "largest absolute entry of the constraint equations", "", "", {}, Reads::time_and_state},
    {"force", "tension of a tsda, torque of an rsda or torsion_bar, force of a stop or contact", "force!", "",
     dimension::kForce, Reads::time_and_state, "N or N m"},
    {"acceleration", "of a body point, kinematic: without gravity", "body! point relative_to component! frame",
     "x y z norm", dimension::kAcceleration, Reads::motion},
    {"reaction", "force or torque of a joint on body2 at its point2, global axes", "joint! kind! component!",
     "x y z norm", dimension::kForce, Reads::motion},
    {"drive_force", "force or torque of a drive along its coordinate, positive if it increases the coordinate",
     "drive!", "", dimension::kForce, Reads::motion, "N or N m"},
    {"imu", "of a body point, in axes fixed in the body: specific force (acceleration minus gravity), angular velocity",
     "body! point axes component!", "ax ay az wx wy wz", dimension::kAcceleration, Reads::motion},
    {"transmission_angle", "from 0 to pi, between the two links that meet in a joint, each towards its only other pin",
     "joint!", "", dimension::kAngle, Reads::state},
    {"smallest_singular_value",
     "of the Jacobian of joints and drives with scaled rows and columns: 0 in a singular position",
     "",
     "",
     {},
     Reads::state},
    {"expression", "of other sensors, parameters, definitions and t", "value!"},
};

// Calls f(word) for each word until it returns true.
template <class F>
bool any_word(std::string_view list, F&& f) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (end > 0 && f(list.substr(0, end))) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

}  // namespace

constinit const std::span<const TypeRow> kJointTypes = kJoints;
constinit const std::span<const TypeRow> kDriveTypes = kDrives;
constinit const std::span<const TypeRow> kForceTypes = kForces;
constinit const std::span<const TypeRow> kSensorQuantities = kQuantities;

Need TypeRow::operator[](std::string_view field) const {
  Need need = Need::unknown;
  any_word(fields, [&](std::string_view word) {
    const bool required = word.back() == '!';
    if (required) word.remove_suffix(1);
    if (word != field) return false;
    need = required ? Need::required : Need::optional;
    return true;
  });
  return need;
}

const TypeRow* find_row(std::span<const TypeRow> rows, std::string_view name) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const TypeRow& r) { return r.name == name; });
  return row == rows.end() ? nullptr : &*row;
}

std::vector<std::string> names_of(std::span<const TypeRow> rows) {
  std::vector<std::string> names;
  for (const TypeRow& row : rows) names.emplace_back(row.name);
  return names;
}

std::vector<std::string> words(std::string_view list) {
  std::vector<std::string> all;
  any_word(list, [&](std::string_view word) { return all.emplace_back(word), false; });
  return all;
}

bool has_word(std::string_view list, std::string_view word) {
  return any_word(list, [&](std::string_view w) { return w == word; });
}

std::string not_among(std::string_view what, std::string_view found, const std::vector<std::string>& available) {
  return "'" + std::string(found) + "' is not a known " + std::string(what) + did_you_mean(found, available) +
         "; available: " + joined(available);
}

bool ties_joints(const Joint& joint) { return joint.type == "gear" || joint.type == "rack_pinion"; }

bool is_sliding(std::string_view motion, std::string_view joint_type) {
  if (!motion.empty()) return motion == "translation";
  return has_word(kJointsWithDisplacement, joint_type) && !has_word(kJointsWithAngle, joint_type);
}

std::string_view type_of(const Force& force) {
  return std::visit([](const auto& kind) { return std::decay_t<decltype(kind)>::kType; }, force.kind);
}

namespace {

// Makes kind the alternative of that name. Does nothing if there is none.
template <class... Kinds>
void emplace_kind(std::variant<Kinds...>& kind, std::string_view type) {
  ((Kinds::kType == type ? void(kind.template emplace<Kinds>()) : void()), ...);
}

}  // namespace

void set_type(Joint& joint, std::string_view type) { joint.type = type; }
void set_type(Drive& drive, std::string_view type) { drive.type = type; }
void set_type(Sensor& sensor, std::string_view type) { sensor.quantity = type; }
void set_type(Force& force, std::string_view type) {
  if (type != type_of(force)) emplace_kind(force.kind, type);
}

std::string_view integrator_names() {
  static const std::string names = [] {
    std::string all;
    for (const Method& method : runge_kutta_methods()) all.append(method.name).append(" ");
    return all.append(kMultistepMethods);
  }();
  return names;
}

Dimension dimension_of_drive(std::string_view type, std::string_view coordinate) {
  if (type == "angle") return dimension::kAngle;
  return type == "coordinate" && coordinate.starts_with('e') ? Dimension{} : dimension::kLength;
}

namespace {

bool is_imu_rate(const Sensor& sensor) { return sensor.quantity == "imu" && sensor.component.starts_with('w'); }

}  // namespace

std::optional<Dimension> dimension_of_quantity(const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row || has_word(row->unit, "or")) return std::nullopt;
  if (is_imu_rate(sensor)) return dimension::kRate;
  return sensor.kind == "torque" ? dimension::kTorque : row->dimension;
}

Reads reads_of_quantity(const Sensor& sensor) {
  const TypeRow* const row = find_row(kSensorQuantities, sensor.quantity);
  if (!row) return Reads::positions;
  return is_imu_rate(sensor) ? Reads::velocities : row->reads;
}

bool can_limit(const Sensor& sensor) {
  const bool is_place =
      sensor.quantity == "position" && sensor.component != "norm" && !sensor.relative_to && !sensor.in_body_frame;
  return is_place || has_word("displacement distance angle body_angle relative_angle", sensor.quantity);
}

bool is_identifier(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  return !text.empty() && letter(text[0]) &&
         std::all_of(text.begin(), text.end(), [&](char c) { return letter(c) || digit(c); });
}

}  // namespace mbsopt
