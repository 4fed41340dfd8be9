#include "app/report/mechanism_sketch.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "core/body/euler_parameters.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Vector3d;

SketchPoint point_by_facts(const SceneFacts& facts, const std::string& body, const PointField& field) {
  const auto s = facts.value(field, body);
  const auto& bodies = facts.scene().bodies;
  const auto found = std::ranges::find(bodies, body, &Body::name);
  return {found == bodies.end() ? kGround : static_cast<std::size_t>(found - bodies.begin()),
          s ? Vector3d((*s)[0], (*s)[1], (*s)[2]) : Vector3d(Vector3d::Zero())};
}

class SketchMaker {
 public:
  explicit SketchMaker(const Scene& scene) : scene_(scene), facts_(scene) {
    for (const Joint& joint : scene.joints) {
      for (const auto* field : {&joint.axis1, &joint.axis2, &joint.normal1, &joint.normal2}) {
        const std::string* name = *field ? std::get_if<std::string>(&**field) : nullptr;
        if (name) directions_.insert(*name);
      }
    }
  }

  Sketch sketch() {
    result_.bodies.resize(scene_.bodies.size());
    for (const Joint& joint : scene_.joints) add_joint(joint);
    for (const Force& force : scene_.forces)
      if (const auto* tsda = std::get_if<Tsda>(&force.kind)) add_spring(*tsda);
    for (const Sensor& sensor : scene_.sensors) add_points_of(sensor);
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) add_own_points(i);
    return std::move(result_);
  }

 private:
  SketchPoint point(const std::string& body, const PointField& field) const {
    return point_by_facts(facts_, body, field);
  }

  // Makes it a point of its body, too.
  SketchPoint add(const std::string& body, const PointField& field) {
    const SketchPoint p = point(body, field);
    if (p.body != kGround) result_.bodies[p.body].push_back(p.s);
    return p;
  }

  void add_joint(const Joint& joint) {
    const SketchPoint p1 = add(joint.body1, joint.point1), p2 = add(joint.body2, joint.point2);
    std::optional<Vector3d> axis;
    if (joint.axis1) axis = point(joint.body1, *joint.axis1).s;
    if (!ties_joints(joint)) result_.joints.push_back({joint.type, p1, p2, axis});
  }

  void add_spring(const Tsda& tsda) {
    const SketchPoint p1 = add(tsda.body1, tsda.point1), p2 = add(tsda.body2, tsda.point2);
    const auto acts = [&](const Field& coefficient) { return facts_.value(coefficient).value_or(1) != 0; };
    result_.springs.push_back({p1, p2, tsda.law || acts(tsda.stiffness), acts(tsda.damping)});
  }

  void add_points_of(const Sensor& sensor) {
    if (!sensor.body.empty()) add(sensor.body, sensor.point);
    if (!sensor.body1.empty() && !sensor.body2.empty())
      add(sensor.body1, sensor.point1), add(sensor.body2, sensor.point2);
    if (sensor.quantity != "position") return;
    const SketchPoint p = point(sensor.body, sensor.point);
    if (p.body == kGround || std::ranges::count(result_.traces, p, &TracedPoint::point) > 0) return;
    const std::string* const name = std::get_if<std::string>(&sensor.point);
    result_.traces.push_back({name ? sensor.body + "." + *name : sensor.name, p});
  }

  // Adds the body's named points except directions of joints. A body without points gets its centre of mass.
  void add_own_points(std::size_t index) {
    const Body& body = scene_.bodies[index];
    for (const auto& [name, coordinates] : body.points)
      if (!directions_.contains(name)) add(body.name, coordinates);
    for (const Shape& shape : body.shapes) {
      const SketchPoint from = add(body.name, shape.from), to = add(body.name, shape.to);
      result_.shapes.push_back({index, shape.type, from.s, to.s, shape.radius});
    }
    if (result_.bodies[index].size() < 2) add(body.name, body.com);
  }

  const Scene& scene_;
  const SceneFacts facts_;
  std::set<std::string> directions_;  // named by joints
  Sketch result_;
};

}  // namespace

Sketch sketch_of(const Scene& scene) { return SketchMaker(scene).sketch(); }

SketchPoint point_of(const Scene& scene, const std::string& body, const PointField& point) {
  return point_by_facts(SceneFacts(scene), body, point);
}

Vector3d placed(const std::vector<double>& row, const SketchPoint& p) {
  if (p.body == kGround) return p.s;
  const double* const b = row.data() + 1 + 13 * p.body;
  const Eigen::Vector4d e(b[3], b[4], b[5], b[6]);
  return Vector3d(b[0], b[1], b[2]) + A(e) * p.s;
}

}  // namespace mbsopt::inline app
