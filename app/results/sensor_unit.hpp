// The unit of a sensor in its scene: there a force or a drive acts along a line or about an axis.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace mbsopt {

inline constexpr const char* kUnknownUnit = "SI unit";  // is shown where a unit is not known

std::string unit_in(const Scene& scene, const Sensor& sensor);

// Names the unit of the force or torque along a drive's coordinate.
std::string unit_of_effort(const Drive& drive);

}  // namespace mbsopt
