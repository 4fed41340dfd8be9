// Which joints, forces and sensors there are, and which fields each one has: one row per type. The reader of problem
// files, the checks of a scene and the JSON Schema all read these tables; a new type is one more row.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/dimension.hpp"

namespace mbsopt {

struct Force;
struct Joint;
struct Sensor;

// Whether a joint ties two other joints (gear, rack_pinion) and has no bodies of its own.
bool ties_joints(const Joint& joint);

// A sensor is a function of these, or of the ones before them.
enum class Reads {
  positions,       // q: conditions may prescribe its value and its rate
  velocities,      // q and v: conditions may prescribe its value
  state,           // q and v, but no condition may prescribe it
  time_and_state,  // laws of drives and forces, too
  motion           // accelerations and reactions: no force may use it
};

struct TypeRow {
  std::string_view name;
  std::string_view description;
  std::string_view fields;           // "point1 axis1!": what it has besides its name, type and bodies; "!": required
  std::string_view components = "";  // of a sensor: what "component" may be
  Dimension dimension = {};          // of a sensor: what it measures (dimension_of_quantity says exceptions)
  Reads reads = Reads::positions;    // of a sensor (reads_of_quantity says exceptions)
  std::string_view unit = "";        // of a sensor whose dimension does not say it
};

inline constexpr TypeRow kJointTypes[] = {
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
    {"fixed", "no motion from the relative pose of point and orientation in the file: 6 equations", "point1 point2"},
    {"distance", "a massless rod of given length between two points: 1 equation", "point1 point2 length!"},
    {"point_on_line", "point2 stays on the line through point1 along axis1: 2 equations", "point1 point2 axis1!"},
    {"point_on_plane", "point2 stays in the plane through point1 with the normal axis1: 1 equation",
     "point1 point2 axis1!"},
    {"perpendicular", "axis1 and axis2 stay perpendicular: 1 equation", "axis1! axis2!"},
    {"gear", "angle(joint2) = ratio angle(joint1) from the start: 1 equation", "joint1! joint2! ratio!"},
    {"rack_pinion", "displacement(joint2) = radius angle(joint1) from the start: 1 equation",
     "joint1! joint2! radius!"},
};

inline constexpr TypeRow kDriveTypes[] = {
    {"coordinate", "a coordinate of a body: of its centre of mass, or an Euler parameter", "body! coordinate!"},
    {"distance", "the distance of two points", "body1 body2! point1 point2"},
    {"angle", "the angle of a revolute, cylindrical or screw joint", "joint!"},
    {"displacement", "the displacement along a translational, cylindrical or screw joint", "joint!"},
};

inline constexpr TypeRow kForceTypes[] = {
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
    {"user", "force written in C++, of a plug-in or of the program, by its name", "force! bodies parameters"},
};

inline constexpr TypeRow kSensorQuantities[] = {
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
    {"constraint_violation", "largest absolute entry of the constraint equations", "", "", {}, Reads::time_and_state},
    {"force", "tension of a tsda, torque of an rsda or torsion_bar", "force!", "", dimension::kForce,
     Reads::time_and_state, "N or N m"},
    {"acceleration", "of a body point, kinematic: without gravity", "body! point relative_to component! frame",
     "x y z norm", dimension::kAcceleration, Reads::motion},
    {"reaction", "force or torque of a joint on body2 at its point2, global axes", "joint! kind! component!",
     "x y z norm", dimension::kForce, Reads::motion},
    {"drive_force", "force or torque of a drive along its coordinate, positive where it pushes it up", "drive!", "",
     dimension::kForce, Reads::motion, "N or N m"},
    {"imu", "of a body point, in axes fixed in the body: specific force (acceleration minus gravity), angular velocity",
     "body! point axes component!", "ax ay az wx wy wz", dimension::kAcceleration, Reads::motion},
    {"transmission_angle", "from 0 to pi, between the two links that meet in a joint, each towards its only other pin",
     "joint!", "", dimension::kAngle, Reads::state},
    {"smallest_singular_value",
     "of the Jacobian of joints and drives, rows and columns scaled: 0 where they lose hold of a motion",
     "",
     "",
     {},
     Reads::state},
    {"expression", "of other sensors, parameters, definitions and t", "value!"},
};

inline constexpr std::string_view kJointsWithAngle = "revolute cylindrical screw";
inline constexpr std::string_view kJointsWithDisplacement = "translational cylindrical screw";

// "euler rk2 ...": every tableau, and CVODES.
std::string_view integrator_names();
inline constexpr std::string_view kMultistepMethods = "cvodes_adams cvodes_bdf";

// Names that mean something in laws and objectives, so that nothing else may be called so.
inline constexpr std::string_view kReservedNames = "t l ldot angle rate pi ground O";

enum class Need { unknown, optional, required };
Need need_of(const TypeRow& row, std::string_view field);

const TypeRow* find_row(std::span<const TypeRow> rows, std::string_view name);  // nullptr when there is none
std::vector<std::string> names_of(std::span<const TypeRow> rows);

// A list of words in one string, separated by blanks.
std::vector<std::string> words(std::string_view list);
bool has_word(std::string_view list, std::string_view word);

// "'gear' is not available in this version; available: revolute, spherical", or what else is wrong with the choice.
std::string not_among(std::string_view what, std::string_view found, const std::vector<std::string>& available,
                      std::string_view later = "");

// Whether friction in a joint resists sliding: as `motion` says, else where the joint has no angle.
bool is_sliding(std::string_view motion, std::string_view joint_type);

// Of a quantity other than expression; scene_facts.hpp finds those of expressions. nullopt: not known (N or N m).
std::optional<Dimension> dimension_of_quantity(const Sensor& sensor);
Reads reads_of_quantity(const Sensor& sensor);

std::string_view type_of(const Force& force);
void set_type(Force& force, std::string_view type);

bool is_identifier(std::string_view text);

Dimension dimension_of_drive(std::string_view type, std::string_view coordinate);

}  // namespace mbsopt
