// A model as the text of a problem file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/files/json_text.hpp"
#include "app/import/imported_model.hpp"
#include "core/expression/expression.hpp"
#include "core/scene/type_table.hpp"

namespace mbsopt::inline app {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSmoothVelocity = 0.01;  // a tenth of a slow joint's rate (docs/forces.md) [rad/s], [m/s]

// Rotations leave some 1e-17 in entries that should be 0; relative to `scale` this is rounding.
double rounded(double value, double scale) {
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  return std::abs(value) < kRounding * scale ? 0 : value;
}

template <class Vector>
Json list(const Vector& v, double scale) {
  Json entries = Json::array();
  for (const double value : v) entries.push_back(rounded(value, scale));
  return entries;
}

class ProblemWriter {
 public:
  explicit ProblemWriter(ImportedModel& model) : model_(model) {
    for (const ImportedBody& b : model.bodies) reach_ = std::max(reach_, b.frame.translation().norm());
    bool dry = false;
    for (const ImportedJoint& j : model.joints) {
      reach_ = std::max({reach_, j.between.translation().norm(), j.point.norm()});
      dry = dry || j.coulomb != 0;
    }
    if (dry)
      model.changed.push_back(fmt::format(
          "dry friction does not stick: it is smoothed over {} rad/s, m/s (smooth_velocity)", kSmoothVelocity));
  }

  Json problem() {
    Json bodies = Json::array();
    for (std::size_t i = 1; i < model_.bodies.size(); ++i) bodies.push_back(body(model_.bodies[i]));
    for (const ImportedJoint& j : model_.joints) add(j);
    for (const ImportedTie& t : model_.ties) add(t);
    Json json{{"format", 1},
              {"name", model_.name},
              {"gravity", list(model_.gravity, model_.gravity.norm())},
              {"bodies", bodies},
              {"joints", joints_}};
    if (!forces_.empty()) json["forces"] = forces_;
    if (!sensors_.empty()) json["sensors"] = sensors_;
    json["simulation"] = {{"start_time", 0}, {"end_time", 1}};
    return json;
  }

 private:
  Json body(const ImportedBody& b) {
    Json json{{"name", b.name}, {"mass", b.mass}};
    if (!b.com.isZero(0)) json["com"] = point(b.com);
    const Matrix3d& J = b.inertia;
    const double size = J.norm();
    const auto entry = [&](int i, int k) { return rounded((J(i, k) + J(k, i)) / 2, size); };
    if (entry(0, 1) == 0 && entry(0, 2) == 0 && entry(1, 2) == 0) {
      json["inertia"] = {entry(0, 0), entry(1, 1), entry(2, 2)};
    } else {
      json["inertia"] = {{"xx", entry(0, 0)}, {"yy", entry(1, 1)}, {"zz", entry(2, 2)},
                         {"xy", entry(0, 1)}, {"xz", entry(0, 2)}, {"yz", entry(1, 2)}};
    }
    json["position"] = list(b.frame.translation(), reach_);
    Eigen::Quaterniond e(b.frame.linear());
    if (e.w() < 0) e.coeffs() *= -1;
    if (e.vec().norm() > 0) json["orientation"] = list(Eigen::Vector4d(e.w(), e.x(), e.y(), e.z()), 1);
    UniqueNames names(UniqueNames::Kind::identifier, {"O"}, &model_.changed);
    for (const auto& [name, at] : b.points) json["points"][names.add(name)] = point(at);
    for (const ImportedShape& s : b.shapes)
      json["shape"].push_back({{"type", s.type}, {"from", point(s.from)}, {"to", point(s.to)}, {"radius", s.radius}});
    return json;
  }

  Json point(const Vector3d& at) const { return list(at, std::max(reach_, at.norm())); }
  static Json direction(const Vector3d& along) { return list(along, 1); }

  void add(const ImportedJoint& j) {
    const ImportedBody& b1 = model_.bodies[static_cast<std::size_t>(j.body1)];
    const ImportedBody& b2 = model_.bodies[static_cast<std::size_t>(j.body2)];
    Json json{{"name", j.name}, {"type", j.type}, {"body1", b1.name}, {"body2", b2.name}};
    json["point1"] = point(j.between * j.point);
    json["point2"] = point(j.point);
    const bool turns = j.type == "revolute", slides = j.type == "translational";
    if (turns || slides || j.type == "planar") {
      json["axis1"] = direction(j.between.linear() * j.axis);
      json["axis2"] = direction(j.axis);
    }
    // The angle is 0 where the model draws the joint. Without normals it would be 0 where the two frames are parallel.
    if (turns && j.between.linear() != Matrix3d::Identity()) {
      json["normal1"] = direction(j.between.linear() * j.axis.unitOrthogonal());
      json["normal2"] = direction(j.axis.unitOrthogonal());
    }
    joints_.push_back(json);
    if (j.type == "spherical" && j.damping != 0) add_ball_damping(j, b1, b2);
    if (!turns && !slides) return;
    const std::string value = add_sensor(j.name, {{"quantity", turns ? "angle" : "displacement"}, {"joint", j.name}});
    if (turns && (j.damping != 0 || j.stiffness != 0)) {
      Json rsda{{"name", j.name + " spring"}, {"type", "rsda"}, {"joint", j.name}};
      if (j.stiffness != 0) rsda["stiffness"] = j.stiffness;
      if (j.damping != 0) rsda["damping"] = j.damping;
      if (j.free_value != 0) rsda["free_angle"] = j.free_value;
      forces_.push_back(rsda);
    }
    if (slides && j.stiffness != 0) add_spring(j, value, b1, b2, json);
    if (j.coulomb != 0 || (slides && j.damping != 0))
      forces_.push_back({{"name", j.name + " friction"},
                         {"type", "friction"},
                         {"joint", j.name},
                         {"coulomb", j.coulomb},
                         {"viscous", slides ? j.damping : 0},
                         {"smooth_velocity", kSmoothVelocity}});
  }

  std::string add_sensor(const std::string& wanted, const Json& sensor) {
    const std::string name = sensor_names_.add(wanted);
    sensors_[name] = sensor;
    return name;
  }

  // Adds a torque -c (omega_2 - omega_1) on body 2 and its opposite on body 1. A bushing would resist the rate of the
  // rotation vector, which differs for large rotations.
  void add_ball_damping(const ImportedJoint& j, const ImportedBody& b1, const ImportedBody& b2) {
    Json on_body2 = Json::array(), on_body1 = Json::array();
    for (const char* axis : {"x", "y", "z"}) {
      const auto rate = [&](const ImportedBody& b) {
        return add_sensor(fmt::format("{}_{}_w{}", j.name, b.name, axis),
                          {{"quantity", "angular_velocity"}, {"body", b.name}, {"component", axis}});
      };
      const std::string c = Expression(j.damping).text(), w2 = rate(b2);
      const std::string relative = j.body1 > 0 ? fmt::format("({} - {})", w2, rate(b1)) : w2;
      on_body2.push_back(fmt::format("-{}*{}", c, relative));
      on_body1.push_back(fmt::format("{}*{}", c, relative));
    }
    const auto add_torque = [&](const char* reaction, const ImportedBody& b, const Json& components) {
      forces_.push_back(
          {{"name", j.name + " damping" + reaction}, {"type", "torque"}, {"body", b.name}, {"components", components}});
    };
    add_torque("", b2, on_body2);
    if (j.body1 > 0) add_torque(" reaction", b1, on_body1);
  }

  // Adds k (x - x0) along the axis, which pulls the two bodies of a translational joint back.
  void add_spring(const ImportedJoint& j, const std::string& x, const ImportedBody& b1, const ImportedBody& b2,
                  const Json& joint) {
    const std::string extension = j.free_value == 0 ? x : fmt::format("({} - {})", x, Expression(j.free_value).text());
    const auto add_force = [&](const char* reaction, const ImportedBody& b, const char* end, double k) {
      Json components = Json::array();
      for (const double a : joint[std::string("axis") + end])
        components.push_back(a == 0 ? Json(0) : Json(fmt::format("{}*{}", Expression(k * a).text(), extension)));
      forces_.push_back({{"name", j.name + " spring" + reaction},
                         {"type", "force"},
                         {"body", b.name},
                         {"point", joint[std::string("point") + end]},
                         {"components", components},
                         {"frame", "body"}});
    };
    add_force("", b2, "2", -j.stiffness);
    if (j.body1 > 0) add_force(" reaction", b1, "1", j.stiffness);
  }

  void add(const ImportedTie& t) {
    joints_.push_back({{"name", t.name},
                       {"type", t.type},
                       {"joint1", model_.joints[static_cast<std::size_t>(t.joint1)].name},
                       {"joint2", model_.joints[static_cast<std::size_t>(t.joint2)].name},
                       {t.type == "gear" ? "ratio" : "radius", t.factor}});
  }

  ImportedModel& model_;
  double reach_ = 0;  // the farthest place [m]
  Json joints_ = Json::array(), forces_ = Json::array(), sensors_ = Json::object();
  UniqueNames sensor_names_{UniqueNames::Kind::identifier, words(kReservedNames), nullptr};
};

std::string one_line(const Json& json) {
  if (json.is_number_float()) return fmt::format("{}", json.get<double>());  // 0 in place of nlohmann's 0.0
  if (!json.is_structured()) return json_text(json);
  std::string text;
  for (const auto& [key, value] : json.items())
    text += (text.empty() ? "" : ", ") + (json.is_object() ? json_text(key) + ": " : "") + one_line(value);
  return json.is_object() ? "{" + text + "}" : "[" + text + "]";
}

}  // namespace

std::string problem_text(ImportedModel& model) {
  const Json problem = ProblemWriter(model).problem();
  std::string text;
  for (const auto& [key, value] : problem.items()) {
    text += fmt::format("{}  {}: ", text.empty() ? "" : ",\n", json_text(key));
    if (!value.is_structured() || value.empty() || !value.front().is_structured()) {
      text += one_line(value);
      continue;
    }
    std::string entries;
    for (const auto& [name, entry] : value.items())
      entries += fmt::format("{}    {}{}", entries.empty() ? "" : ",\n",
                             value.is_object() ? json_text(name) + ": " : "", one_line(entry));
    text += value.is_object() ? "{\n" + entries + "\n  }" : "[\n" + entries + "\n  ]";
  }
  return "{\n" + text + "\n}\n";
}

}  // namespace mbsopt::inline app
