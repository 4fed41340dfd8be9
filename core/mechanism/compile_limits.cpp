// Limits on sensors. Each has a force along the gradient of its sensor, whose size is 0 but for impulses.
#include <algorithm>

#include "core/constraint/dot2.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/scene/scene_error.hpp"
#include "core/scene/scene_facts.hpp"
#include "core/scene/scene_path.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt {
namespace {

template <class Kind>
ForcePlace added(Compilation& model, Kind force) {
  force.force = -1;  // of no force of the scene
  std::vector<Kind>& all = model.data.forces->of<Kind>();
  all.push_back(std::move(force));
  ForcePlace place;
  model.data.forces->for_each([&]<class Of>(const Of&, ForcePlace at) {
    if constexpr (std::is_same_v<Of, Kind>) place = at;
  });
  return place;
}

ForcePlace force_along(Compilation& model, const Sensor& s, const std::string& where) {
  if (s.quantity == "position") {
    SlidingForce out{-1, {{0, model.body_index(s.body, where)}, {}}, -1, {}};
    out.joint.measure.s2 = numbers(model.keep(out.joint.slot2, model.point(out.joint.body2, s.point, where)));
    out.joint.measure.s3 = Vector3d::Unit(s.component[0] - 'x');
    return added(model, std::move(out));
  }
  if (s.quantity == "displacement")
    return added(model, SlidingForce{-1, model.joint_displacement(s.joint, where + ".joint"), -1, {}});
  if (s.quantity == "distance") {
    TsdaForce out;
    out.body1 = model.body_index(s.body1.empty() ? "ground" : s.body1, where);
    out.body2 = model.body_index(s.body2, where);
    out.s1 = numbers(model.keep(out.slot1, model.point(out.body1, s.point1, where + ".point1")));
    out.s2 = numbers(model.keep(out.slot2, model.point(out.body2, s.point2, where + ".point2")));
    return added(model, std::move(out));
  }
  int angle = -1;
  if (s.quantity == "angle") {
    angle = model.angle_of(s.joint, where + ".joint");
  } else {
    const int body1 = s.body1.empty() ? 0 : model.body_index(s.body1, where + ".body1");
    angle = model.angle_about(body1, model.body_index(s.body2.empty() ? s.body : s.body2, where), s.axis, where);
  }
  return added(model, RsdaForce{-1, model.data.angles[static_cast<std::size_t>(angle)], angle, {}});
}

}  // namespace

void compile_limits(Compilation& model) {
  Symbols symbols = model.fields.symbols();
  if (!model.scene.limits.empty()) add_time_and_sensors(symbols, model.scene);
  for (std::size_t i = 0; i < model.scene.limits.size(); ++i) {
    const Limit& limit = model.scene.limits[i];
    const std::string where = child_path("limits", i);
    const auto sensor = std::ranges::find(model.scene.sensors, limit.sensor, &Sensor::name);
    if (sensor == model.scene.sensors.end() || !can_limit(*sensor))
      throw SceneError(where + ".sensor: '" + limit.sensor + "' is no position, displacement, distance or angle");
    LimitData out;
    out.name = limit.name;
    out.force = force_along(model, *sensor, where + ".sensor");
    const FieldValue e = model.fields.value(limit.restitution, where + ".restitution");
    out.e = e.value();
    out.slot_e = model.fields.slot(e);
    if (!(out.e >= 0 && out.e <= 1)) throw SceneError(where + ".restitution: must be from 0 to 1");
    for (const auto& [bound, key, sign] : {std::tuple{&limit.lower, ".lower", 1}, {&limit.upper, ".upper", -1}}) {
      if (!*bound) continue;
      const std::string text = "(" + limit.sensor + "-(" + (*bound)->text() + "))*" + std::to_string(sign);
      try {
        out.gap = Program(Expression::parse(text), symbols);
      } catch (const UnknownName& error) {
        throw SceneError(where + key + ": " + error.what());
      }
      out.sign = sign;
      model.data.limits.push_back(out);
    }
  }
}

}  // namespace mbsopt
