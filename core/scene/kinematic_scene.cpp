#include "core/scene/kinematic_scene.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/scene/scene_path.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {

Scene kinematic_scene(const Scene& scene, std::vector<SceneIssue>& issues) {
  Scene out = scene;
  out.conditions.clear();
  for (std::size_t i = 0; i < scene.conditions.size(); ++i) {
    const Condition& c = scene.conditions[i];
    const std::string where = child_path("initial.conditions", i);
    const auto sensor = std::ranges::find(scene.sensors, c.sensor, &Sensor::name);
    if (sensor == scene.sensors.end()) continue;  // an issue of its own
    const std::string& quantity = sensor->quantity;
    const bool is_point =
        quantity == "position" && sensor->component != "norm" && !sensor->relative_to && !sensor->in_body_frame;
    if (!is_point && !has_word("angle displacement distance orientation", quantity)) {
      issues.push_back(
          {where + ".sensor",
           fmt::format("sensor '{}' measures {}, which kinematics cannot hold; use an angle, displacement, "
                       "distance, Euler parameter or global coordinate of a point, or a drive",
                       c.sensor, quantity)});
      continue;
    }
    if (!c.value) {
      issues.push_back({where + ".value", "is missing; kinematics needs the value at the start beside the rate"});
      continue;
    }
    Drive drive;
    drive.name = "condition on " + c.sensor;
    drive.type = is_point ? "point" : quantity == "orientation" ? "coordinate" : quantity;
    drive.joint = sensor->joint;
    drive.body = sensor->body;
    drive.coordinate = sensor->component;
    if (!sensor->body1.empty()) drive.body1 = sensor->body1;
    drive.body2 = sensor->body2;
    drive.point1 = sensor->point1;
    drive.point2 = is_point ? sensor->point : sensor->point2;
    const std::string since_start = "(t - " + Expression(scene.simulation.start_time).text() + ")";
    std::string law = fmt::format("({})", c.value->text());
    if (c.rate) law += fmt::format(" + ({})*{}", c.rate->text(), since_start);
    if (c.acceleration) law += fmt::format(" + ({})*{}^2/2", c.acceleration->text(), since_start);
    drive.law = Expression::parse(law);
    out.drives.push_back(std::move(drive));
  }
  return out;
}

}  // namespace mbsopt
