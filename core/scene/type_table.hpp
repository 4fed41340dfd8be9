// The types of joints, forces and sensors, and the fields of each: one row per type. The reader of problem files, the
// checks of a scene and the JSON Schema all read these tables. A new type is one more row.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/expression/dimension.hpp"

namespace mbsopt {

struct Drive;
struct Force;
struct Joint;
struct Sensor;

// Returns whether a joint ties two other joints (gear, rack_pinion) and has no bodies of its own.
bool ties_joints(const Joint& joint);

// The quantities that a sensor is a function of; each one includes those before it.
enum class Reads {
  positions,       // q: conditions may prescribe its value and its rate
  velocities,      // q and v: conditions may prescribe its value
  state,           // q and v, but no condition may prescribe it
  time_and_state,  // laws of drives and forces, too
  motion           // accelerations and reactions: no force may use it
};

enum class Need { unknown, optional, required };

struct TypeRow {
  std::string_view name;
  std::string_view description;
  std::string_view fields;           // "point1 axis1!": what it has besides its name, type and bodies; "!": required
  std::string_view components = "";  // of a sensor: the values of "component"
  Dimension dimension = {};          // of a sensor's values (dimension_of_quantity has exceptions)
  Reads reads = Reads::positions;    // of a sensor (reads_of_quantity has exceptions)
  std::string_view unit = "";        // of a sensor whose dimension does not determine it

  Need operator[](std::string_view field) const;  // how the type needs a field
};

extern const std::span<const TypeRow> kJointTypes, kDriveTypes, kForceTypes, kSensorQuantities;

inline constexpr std::string_view kJointsWithAngle = "revolute cylindrical screw";
inline constexpr std::string_view kJointsWithDisplacement = "translational cylindrical screw";

// "euler rk2 ...": every tableau, and CVODES.
std::string_view integrator_names();
inline constexpr std::string_view kMultistepMethods = "cvodes_adams cvodes_bdf";

// Names with a meaning in laws and objectives; nothing else may use them.
inline constexpr std::string_view kReservedNames = "t l ldot angle rate pi ground O";

const TypeRow* find_row(std::span<const TypeRow> rows, std::string_view name);  // nullptr when there is none
std::vector<std::string> names_of(std::span<const TypeRow> rows);

// A list of words in one string, separated by blanks.
std::vector<std::string> words(std::string_view list);
bool has_word(std::string_view list, std::string_view word);

// "'gaer' is not a known type (did you mean 'gear'?); available: revolute, gear"
std::string not_among(std::string_view what, std::string_view found, const std::vector<std::string>& available);

// Returns whether friction in a joint resists sliding: `motion` decides if given, else a joint without an angle slides.
bool is_sliding(std::string_view motion, std::string_view joint_type);

// The dimension of a quantity other than expression, which scene_facts.hpp finds. nullopt stands for N or N m, which is
// not known here.
std::optional<Dimension> dimension_of_quantity(const Sensor& sensor);
Reads reads_of_quantity(const Sensor& sensor);
// Returns whether a limit may be on the sensor: a force along its gradient is known.
bool can_limit(const Sensor& sensor);

std::string_view type_of(const Force& force);
void set_type(Joint& joint, std::string_view type);
void set_type(Drive& drive, std::string_view type);
void set_type(Force& force, std::string_view type);
void set_type(Sensor& sensor, std::string_view type);

bool is_identifier(std::string_view text);

Dimension dimension_of_drive(std::string_view type, std::string_view coordinate);

}  // namespace mbsopt
