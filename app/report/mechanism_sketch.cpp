#include "app/report/mechanism_sketch.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "core/body/euler_parameters.hpp"
#include "core/scene/scene_facts.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Vector3d;

SketchPoint point_by_facts(const SceneFacts& facts, const std::string& body, const PointField& field) {
  const auto s = facts.value(field, body);
  const Body* const found = facts.body(body);
  return {found ? static_cast<std::size_t>(found - facts.scene().bodies.data()) : kGround,
          s ? Vector3d((*s)[0], (*s)[1], (*s)[2]) : Vector3d(Vector3d::Zero())};
}

struct JointSymbol {
  const char *type, *path, *line = "";  // line: along its axis
};
constexpr const char *kBlock = "M-9 -5h18v10h-18Z", *kDisc = "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0",
                     *kSmallDisc = "M-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0", *kRail = "M-22 0H22",
                     *kBlockAndDisc = "M-9 -5h18v10h-18ZM-3 0a3 3 0 1 0 6 0a3 3 0 1 0 -6 0";
constexpr JointSymbol kJointSymbols[] = {
    {"translational", kBlock, kRail},
    {"cylindrical", kBlockAndDisc, kRail},
    {"screw", kBlockAndDisc, kRail},
    {"point_on_line", kDisc, kRail},
    {"fixed", "M-4 -4h8v8h-8Z"},
    {"distance", kDisc},
    {"spherical", "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0M-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0"},
    {"universal", "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0M-4 0h8M0 -4v8"},
    {"planar", kSmallDisc},
    {"point_on_plane", kSmallDisc},
    {"perpendicular", ""},
    {"", kDisc, "M-12 0H12"}};  // all others
constexpr const char* kGroundPath = "M-8 13L0 0L8 13M-12 13H12M-8 13l-4 5M-2 13l-4 5M4 13l-4 5M10 13l-4 5";

// Between the ends of a spring, at 0 and 1: seen from the side, and a little from the end. beside [px]
std::string coil(double beside) {
  constexpr int kTurns = 10, kSamples = 10;  // kSamples: of a turn
  std::string path;
  for (int i = 0; i <= kTurns * kSamples; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSamples;
    path +=
        fmt::format("{}{:.3f} {:.1f}", i == 0 ? 'M' : 'L',
                    0.15 + 0.7 * i / (kTurns * kSamples) + 0.02 * (1 - std::cos(angle)), beside + 5 * std::sin(angle));
  }
  return path;
}

std::string spring_path(bool spring, bool damper) {
  if (!damper) return "M0 0H.15" + coil(0) + "M.85 0H1";
  if (!spring) return "M0 0H.4M.65 -5H.4V5H.65M.52 -4V4M.52 0H1";
  return "M0 0H.15M.15 -8V8" + coil(-8) + "M.15 8H.4M.65 3H.4V13H.65M.52 4V12M.52 8H.85M.85 -8V8M.85 0H1";
}

// The corners of a box or of a cylinder.
std::vector<Vector3d> corners_of(const std::string& type, const Vector3d& from, const Vector3d& to, double radius) {
  const int corners = type == "box" ? 4 : 24;
  const double size = type == "box" ? std::sqrt(2.0) * radius : radius;
  const Vector3d along = (to - from).normalized();
  Eigen::Index k = 0;
  along.cwiseAbs().minCoeff(&k);
  const Vector3d n = along.cross(Vector3d::Unit(k)).normalized(), m = along.cross(n);
  std::vector<Vector3d> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / corners;
    for (const Vector3d& end : {from, to}) points.push_back(end + size * (std::cos(angle) * n + std::sin(angle) * m));
  }
  return points;
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
    if (p.body != kGround) result_.bodies[p.body].points.push_back(p.s);
    return p;
  }

  void add_joint(const Joint& joint) {
    const SketchPoint p1 = add(joint.body1, joint.point1), p2 = add(joint.body2, joint.point2);
    if (ties_joints(joint)) return;
    const JointSymbol& symbol = *std::ranges::find_if(
        kJointSymbols, [&](const JointSymbol& s) { return *s.type == 0 || s.type == joint.type; });
    std::optional<SketchPoint> axis;
    if (joint.axis1) axis = point(joint.body1, *joint.axis1);
    if (axis) axis->s.normalize();
    for (const SketchPoint& p : {p1, p2})
      if (p.body == kGround) result_.marks.push_back({"ground", kGroundPath, p});
    if (joint.type == "distance") {
      result_.marks.push_back({"joint", "M0 0H1", p1, p2});
      result_.marks.push_back({"joint", kDisc, p1});
    }
    if (axis && *symbol.line) result_.marks.push_back({"joint", symbol.line, p2, {}, axis, true});
    if (*symbol.path) result_.marks.push_back({"joint " + joint.type, symbol.path, p2, {}, axis});
  }

  void add_spring(const Tsda& tsda) {
    const SketchPoint p1 = add(tsda.body1, tsda.point1), p2 = add(tsda.body2, tsda.point2);
    const auto acts = [&](const Field& coefficient) { return facts_.value(coefficient).value_or(1) != 0; };
    result_.marks.push_back({"spring", spring_path(tsda.law || acts(tsda.stiffness), acts(tsda.damping)), p1, p2});
  }

  void add_points_of(const Sensor& sensor) {
    if (!sensor.body.empty()) add(sensor.body, sensor.point);
    if (!sensor.body1.empty() && !sensor.body2.empty()) {
      add(sensor.body1, sensor.point1);
      add(sensor.body2, sensor.point2);
    }
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
    SketchedBody& drawn = result_.bodies[index];
    for (const Shape& shape : body.shapes) {
      const SketchPoint from = add(body.name, shape.from), to = add(body.name, shape.to);
      if (shape.type == "sphere" || from == to) {
        const std::string style = fmt::format("body solid c{0} f{0}", index % 8);
        result_.marks.push_back({style, "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0 -2 0", from, {}, {}, false, shape.radius});
        for (const double r : {-shape.radius, shape.radius})
          for (int k = 0; k < 3; ++k) drawn.points.push_back(from.s + r * Vector3d::Unit(k));
      } else {
        drawn.hulls.push_back(corners_of(shape.type, from.s, to.s, shape.radius));
      }
    }
    if (drawn.points.size() < 2) add(body.name, body.com);
    drawn.solid = !body.shapes.empty();
    if (!drawn.solid) drawn.hulls = {drawn.points};
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
  const Vector3d r = p.body == kGround ? Vector3d(Vector3d::Zero()) : Vector3d(row.data() + 1 + 13 * p.body);
  return r + turned(row, p);
}

Vector3d turned(const std::vector<double>& row, const SketchPoint& direction) {
  if (direction.body == kGround) return direction.s;
  return A(Eigen::Vector4d(row.data() + 4 + 13 * direction.body)) * direction.s;
}

}  // namespace mbsopt::inline app
