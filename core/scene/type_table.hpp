// Which joints, forces and sensors there are, and which fields each one has: one row per type. The reader of problem
// files, the checks of a scene and the JSON Schema all read these tables; a new type is one more row.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/dimension.hpp"

namespace mbsopt {

struct Force;

struct TypeRow {
  std::string_view name;
  std::string_view description;
  std::string_view fields;           // "point1 axis1!": what it has besides its name, type and bodies; "!": required
  std::string_view components = "";  // of a sensor: what "component" may be
  Dimension dimension = {};          // of a sensor: what it measures
  bool velocity_level = false;       // of a sensor: a condition on it has a value only
};

inline constexpr TypeRow kJointTypes[] = {
    {"revolute", "a common point and a common axis: 5 equations", "point1 point2 axis1! axis2! normal1 normal2"},
    {"spherical", "a common point: 3 equations", "point1 point2"},
};

inline constexpr TypeRow kForceTypes[] = {
    {"tsda", "spring, damper and actuator between two points: k (l - l0) + c ldot + actuator, or a law",
     "body1 body2! point1 point2 stiffness damping free_length actuator law"},
    {"rsda", "torsional spring and damper on the angle of a revolute joint: k (angle - angle0) + c rate, or a law",
     "joint! stiffness damping free_angle law"},
};

inline constexpr TypeRow kSensorQuantities[] = {
    {"position", "of a body point", "body! point relative_to component! frame", "x y z norm", dimension::kLength},
    {"velocity", "of a body point", "body! point relative_to component! frame", "x y z norm", dimension::kVelocity,
     true},
    {"angle", "of a revolute joint, continuous over many turns", "joint!", "", dimension::kAngle},
    {"rate", "time derivative of a joint's angle", "joint!", "", dimension::kRate, true},
    {"distance", "of two body points", "body1 body2! point1 point2", "", dimension::kLength},
    {"distance_rate", "time derivative of a distance", "body1 body2! point1 point2", "", dimension::kVelocity, true},
    {"angular_velocity", "of a body", "body! component! frame", "x y z norm", dimension::kRate, true},
    {"orientation", "Euler parameters of a body", "body! component!", "e0 e1 e2 e3"},
    {"energy", "of the whole mechanism", "component!", "kinetic potential total", dimension::kTorque, true},
    {"constraint_violation", "largest absolute entry of the constraint equations", ""},
};

// In the problem format, not in this version.
inline constexpr std::string_view kLaterJointTypes =
    "translational universal cylindrical planar fixed distance point_on_line point_on_plane perpendicular gear "
    "rack_pinion screw";
inline constexpr std::string_view kLaterForceTypes = "force torque bushing friction";
inline constexpr std::string_view kLaterSensorQuantities = "acceleration displacement force reaction";

inline constexpr std::string_view kIntegrators = "dopri5 dopri853 rk4";
inline constexpr std::string_view kLaterIntegrators =
    "euler rk2 bs3 verner6 sdirk2 sdirk3 sdirk4 radau5 gauss4 cvodes_bdf cvodes_adams";

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

std::string_view type_of(const Force& force);
void set_type(Force& force, std::string_view type);

bool is_identifier(std::string_view text);

}  // namespace mbsopt
