// The function that makes each quantity of kSensorQuantities from the scene. A new sensor is a file with its maker, a
// row here and a row there. A maker throws SceneError.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/mechanism/compilation.hpp"
#include "core/scene/scene_error.hpp"

namespace mbsopt {

using SensorMaker = std::unique_ptr<SensorFunction>(Compilation& model, const Sensor& sensor, const std::string& where);

SensorMaker make_point, make_distance;                                               // point_sensors.cpp
SensorMaker make_joint_angle, make_body_angle, make_displacement, make_orientation;  // joint_sensors.cpp
SensorMaker make_angular_velocity, make_imu;                                         // rotation_sensors.cpp
SensorMaker make_mass_sum;                                                           // mass_sensors.cpp
SensorMaker make_reaction, make_drive_force;                                         // reaction_sensor.cpp
SensorMaker make_energy, make_violation, make_tension, make_angular_momentum;        // a file each
SensorMaker make_transmission_angle, make_smallest_singular_value, make_expression;

struct SensorMakerRow {
  std::string_view quantity;
  SensorMaker* make;
};
inline constexpr SensorMakerRow kSensorMakers[] = {
    {"position", make_point},
    {"velocity", make_point},
    {"distance", make_distance},
    {"distance_rate", make_distance},
    {"acceleration", make_point},
    {"angle", make_joint_angle},
    {"rate", make_joint_angle},
    {"body_angle", make_body_angle},
    {"relative_angle", make_body_angle},
    {"displacement", make_displacement},
    {"angular_velocity", make_angular_velocity},
    {"orientation", make_orientation},
    {"energy", make_energy},
    {"centre_of_mass", make_mass_sum},
    {"momentum", make_mass_sum},
    {"angular_momentum", make_angular_momentum},
    {"constraint_violation", make_violation},
    {"force", make_tension},
    {"reaction", make_reaction},
    {"drive_force", make_drive_force},
    {"imu", make_imu},
    {"transmission_angle", make_transmission_angle},
    {"smallest_singular_value", make_smallest_singular_value},
    {"expression", make_expression},
};

// The index of the component; 3 stands for a norm.
int component_of(const Sensor& sensor, const std::string& where);

}  // namespace mbsopt
