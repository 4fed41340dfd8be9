#include "core/scene/kinematic_scene.hpp"

#include <algorithm>

#include "core/scene/scene_path.hpp"

namespace mbsopt {
namespace {

std::string in_brackets(const Expression& e) { return "(" + e.text() + ")"; }

}  // namespace

Scene kinematic_scene(const Scene& scene, std::vector<SceneIssue>& issues) {
  Scene out = scene;
  out.conditions.clear();
  for (std::size_t i = 0; i < scene.conditions.size(); ++i) {
    const Condition& c = scene.conditions[i];
    const std::string where = child_path("initial.conditions", i);
    const auto sensor =
        std::find_if(scene.sensors.begin(), scene.sensors.end(), [&](const Sensor& s) { return s.name == c.sensor; });
    if (sensor == scene.sensors.end()) continue;  // an issue of its own
    Drive drive;
    drive.name = "condition on " + c.sensor;
    if (sensor->quantity == "angle" || sensor->quantity == "displacement") {
      drive.type = sensor->quantity;
      drive.joint = sensor->joint;
    } else if (sensor->quantity == "distance") {
      drive.type = "distance";
      drive.body1 = sensor->body1.empty() ? "ground" : sensor->body1;
      drive.body2 = sensor->body2;
      drive.point1 = sensor->point1;
      drive.point2 = sensor->point2;
    } else if (sensor->quantity == "position" && sensor->component != "norm" && !sensor->relative_to &&
               !sensor->in_body_frame) {
      drive.type = "point";
      drive.body = sensor->body;
      drive.point2 = sensor->point;
      drive.coordinate = sensor->component;
    } else if (sensor->quantity == "orientation") {
      drive.type = "coordinate";
      drive.body = sensor->body;
      drive.coordinate = sensor->component;
    } else {
      issues.push_back({where + ".sensor", "sensor '" + c.sensor + "' measures " + sensor->quantity +
                                               ", which kinematics cannot hold; use an angle, displacement, distance, "
                                               "Euler parameter or global coordinate of a point, or a drive"});
      continue;
    }
    if (!c.value) {
      issues.push_back({where + ".value", "is missing; kinematics needs the value at the start beside the rate"});
      continue;
    }
    const std::string since_start = "(t - " + Expression(scene.simulation.start_time).text() + ")";
    std::string law = in_brackets(*c.value);
    if (c.rate) law += " + " + in_brackets(*c.rate) + "*" + since_start;
    if (c.acceleration) law += " + " + in_brackets(*c.acceleration) + "*" + since_start + "^2/2";
    drive.law = Expression::parse(law);
    out.drives.push_back(std::move(drive));
  }
  return out;
}

}  // namespace mbsopt
