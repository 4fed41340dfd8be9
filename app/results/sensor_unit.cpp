#include "app/results/sensor_unit.hpp"

#include <algorithm>

#include "core/scene/scene_facts.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {

// Power is effort times rate: the unit is N if the coordinate is a length, N m if it is an angle or a number.
std::string unit_of_effort(const Drive& drive) {
  return dimension_of_drive(drive.type, drive.coordinate) == dimension::kLength ? "N" : "N m";
}

std::string unit_in(const Scene& scene, const Sensor& sensor) {
  if (sensor.quantity == "force") {
    const auto force = std::ranges::find(scene.forces, sensor.force, &Force::name);
    if (force != scene.forces.end()) return std::holds_alternative<Tsda>(force->kind) ? "N" : "N m";
  }
  if (sensor.quantity == "drive_force") {
    const auto drive = std::ranges::find(scene.drives, sensor.drive, &Drive::name);
    if (drive != scene.drives.end()) return unit_of_effort(*drive);
  }
  return unit_of(scene, sensor);
}

}  // namespace mbsopt
