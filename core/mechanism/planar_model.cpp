#include "core/mechanism/planar_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "core/body/euler_parameters.hpp"
#include "core/constraint/constraint.hpp"
#include "core/mechanism/joint_graph.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt {
namespace {

constexpr double kParallel = 1e-12;  // sine of the angle up to which a direction counts as another

// The position of a body-fixed vector relative to the plane, at every value of the parameters.
enum class Lies { in_plane, along_normal, across };

class PlanarCompilation {
 public:
  PlanarCompilation(const Scene& scene, const MechanismData& data, int normal) : scene_(scene), data_(data) {
    model_.n = normal;
    model_.t1 = (normal + 1) % 3;
    model_.t2 = (normal + 2) % 3;
  }

  // Returns the reason why there is no model, or an empty string.
  std::string run() {
    if (data_.n == 0) return "there is no moving body";
    for (const UserForceData& f : data_.user_forces)
      if (f.force->inertia()) return "mass terms written in C++ act in space";
    place_bodies();
    terms_.assign(at(data_.m), 0);
    for (const Constraint& c : data_.constraints) ++terms_[at(c.row)];
    for (const RowLaw& law : data_.laws) ++terms_[at(law.row)];
    has_levels_ = has_levels();
    for (const Constraint& c : data_.constraints) {
      if (std::string reason = add(c); !reason.empty()) return reason;
    }
    model_.gravity = model_.in_plane(data_.gravity);
    number_rows();
    return body_not_held();
  }
  PlanarModel take() { return std::move(model_); }

  // Counts rows that keep an axis along the normal. If no normal has a model, the one with most such rows is meant.
  int axes_along_normal() const {
    int count = 0;
    for (const Constraint& c : data_.constraints) {
      const auto* parallel = std::get_if<Dot1>(&c.primitive);
      if (parallel && !model_.bodies.empty()) {
        count += lies(c.body2, parallel->s2, c.slot2) == Lies::along_normal ? 1 : 0;
      }
    }
    return count;
  }

 private:
  void place_bodies() {
    const Vector3d n = Vector3d::Unit(model_.n);
    for (const BodyData& b : data_.bodies) {
      PlanarBody body;
      const Matrix3d A0 = A(b.q.tail<4>().isZero() ? Vector4d(1, 0, 0, 0) : Vector4d(b.q.tail<4>().normalized()));
      const Vector3d own = A0.transpose() * n;
      if ((own - n).norm() > kParallel) {
        const Eigen::Quaterniond q = Eigen::Quaterniond::FromTwoVectors(own, n);
        body.p_a << q.w(), q.vec();
      }
      // (0, n) times p_a
      body.p_b << -n.dot(body.p_a.tail<3>()), body.p_a(0) * n + n.cross(body.p_a.tail<3>());
      const Matrix3d turned = A(body.p_a);
      body.b1 = turned.row(model_.t1);
      body.b2 = turned.row(model_.t2);
      body.n = turned.row(model_.n);
      body.mass = b.mass;
      body.inertia = body.n.dot(b.J * body.n);
      model_.bodies.push_back(body);
    }
  }

  // Returns whether a parameter changes a vector along an axis.
  bool moves(const Vector3d& axis, int slot) const {
    if (slot < 0) return false;
    const auto change = data_.theta_rho.middleRows<3>(slot);
    return (axis.transpose() * change).cwiseAbs().maxCoeff() > kParallel * change.cwiseAbs().maxCoeff();
  }
  Lies lies(int body, const Vector3d& s, int slot) const {
    const PlanarBody& b = model_.bodies[at(body)];
    const double size = s.norm();
    if (std::abs(b.n.dot(s)) <= kParallel * size && !moves(b.n, slot)) return Lies::in_plane;
    const Plane rest = b.in_plane(s);
    if (std::hypot(rest.re, rest.im) <= kParallel * size && !moves(b.b1, slot) && !moves(b.b2, slot))
      return Lies::along_normal;
    return Lies::across;
  }

  std::string name(const Constraint& c) const {
    if (c.drive >= 0) return "drive '" + data_.drive_names[at(c.drive)] + "'";
    return "joint '" + data_.joint_names[at(c.joint)] + "'";
  }

  // Drops a row that every planar motion satisfies.
  std::string drop(const Constraint& c) const {
    return terms_[at(c.row)] > 1 ? name(c) + " moves bodies out of the plane" : "";
  }

  std::string add(const Constraint& c) {
    PlanarConstraint out{c};
    out.row = c.row;
    out.factor = c.factor;
    out.slot_factor = c.slot_factor;
    out.angle = c.angle;
    const PlanarBody &b1 = model_.bodies[at(c.body1)], &b2 = model_.bodies[at(c.body2)];
    const std::string tilted = name(c) + " has a direction that is neither in the plane nor across it";
    auto keep = [&](PlanarConstraint::Kind kind) {
      out.kind = kind;
      model_.constraints.push_back(out);
      return std::string();
    };
    return std::visit(
        [&]<class P>(const P& p) -> std::string {
          using Kind = PlanarConstraint::Kind;
          if constexpr (!std::is_same_v<P, Coordinate>) out.s1 = b1.in_plane(p.s1), out.s2 = b2.in_plane(p.s2);
          if constexpr (std::is_same_v<P, Coincidence>) {
            out.row = c.row + model_.t1;
            out.row2 = c.row + model_.t2;
            return keep(Kind::point);
          } else if constexpr (std::is_same_v<P, Dot1>) {
            const Lies first = lies(c.body1, p.s1, c.slot1), second = lies(c.body2, p.s2, c.slot2);
            if (first == Lies::across || second == Lies::across) return tilted;
            if (first == Lies::in_plane && second == Lies::in_plane) return keep(Kind::dot1);
            if (first == second) return name(c) + " holds two normals of the plane at right angles";
            return drop(c);
          } else if constexpr (std::is_same_v<P, Dot2>) {
            const Lies direction = lies(c.body1, p.s3, c.slot3);
            if (direction == Lies::across) return tilted;
            if (direction == Lies::along_normal) return drop(c);
            out.s3 = b1.in_plane(p.s3);
            return keep(Kind::dot2);
          } else if constexpr (std::is_same_v<P, Distance>) {
            const double out1 = b1.n.dot(p.s1), out2 = b2.n.dot(p.s2);
            if (c.slot1 >= 0 && lies(c.body1, p.s1, c.slot1) != Lies::in_plane) return tilted;
            if (c.slot2 >= 0 && lies(c.body2, p.s2, c.slot2) != Lies::in_plane) return tilted;
            const double level = kParallel * (p.s1.norm() + p.s2.norm());
            if (std::abs(out1) > level || std::abs(out2) > level || has_levels_) {
              return name(c) + " may join points at different heights";
            }
            return keep(Kind::distance);
          } else if constexpr (std::is_same_v<P, Angle>) {
            for (const auto& [body, s, slot] : {std::tuple(c.body1, p.s1, c.slot1), std::tuple(c.body2, p.s2, c.slot2),
                                                std::tuple(c.body1, p.s3, c.slot3)}) {
              if (lies(body, s, slot) != Lies::in_plane) return tilted;
            }
            out.sign = cross(b1.in_plane(p.s1), b1.in_plane(p.s3)) > 0 ? 1 : -1;
            return keep(Kind::angle);
          } else {
            return name(c) + " prescribes a single coordinate";
          }
        },
        c.primitive);
  }

  void number_rows() {
    std::vector<int>& rows = model_.rows;
    for (const PlanarConstraint& c : model_.constraints) {
      rows.push_back(c.row);
      if (c.kind == PlanarConstraint::Kind::point) rows.push_back(c.row2);
    }
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    const auto number = [&](int row) {
      return static_cast<int>(std::lower_bound(rows.begin(), rows.end(), row) - rows.begin());
    };
    for (PlanarConstraint& c : model_.constraints) {
      c.row = number(c.row);
      if (c.kind == PlanarConstraint::Kind::point) c.row2 = number(c.row2);
    }
  }

  // Returns whether bodies may lie at other heights than the ground, where a rod's length is not its length in the
  // plane. Then a point, or a row along the normal, joins two heights.
  bool has_levels() const {
    for (const Constraint& c : data_.constraints) {
      const auto* point = std::get_if<Coincidence>(&c.primitive);
      const auto* plane = std::get_if<Dot2>(&c.primitive);
      if (!point && !(plane && lies(c.body1, plane->s3, c.slot3) != Lies::in_plane)) continue;
      const Vector3d &s1 = point ? point->s1 : plane->s1, &s2 = point ? point->s2 : plane->s2;
      const Vector3d &n1 = model_.bodies[at(c.body1)].n, &n2 = model_.bodies[at(c.body2)].n;
      if (std::abs(n1.dot(s1) - n2.dot(s2)) > kParallel * (s1.norm() + s2.norm())) return true;
      if (moves(n1, c.slot1) || moves(n2, c.slot2)) return true;
    }
    return false;
  }

  // Follows joints from the ground; a joint that holds() keeps one of its bodies in the plane if the other one is.
  // Returns a message on a body that no joint holds, or an empty string.
  std::string body_not_held() const {
    Neighbours neighbours(data_.bodies.size());
    int seen = -1;  // the joint whose first dot-1, which has axis 2, was tested
    for (const Constraint& c : data_.constraints) {
      if (c.joint < 0 || c.joint == seen || !std::holds_alternative<Dot1>(c.primitive)) continue;
      seen = c.joint;
      if (holds(c)) join(c.body1, c.body2, neighbours);
    }
    std::vector<int> joints(data_.bodies.size(), -1);
    measure_paths(neighbours, 0, joints);
    for (int i = 1; i <= data_.n; ++i) {
      if (joints[at(i)] < 0) {
        return fmt::format("no joint holds body '{}' in the plane (revolute, planar, translational or fixed joints do)",
                           data_.body_names[at(i)]);
      }
    }
    return "";
  }

  // Returns whether a joint holds bodies in the plane. The answer comes from its first dot-1, which contains axis 2 if
  // the joint has axes.
  bool holds(const Constraint& c) const {
    const std::string& type = scene_.joints[at(c.joint)].type;
    const Lies axis = lies(c.body2, std::get<Dot1>(c.primitive).s2, c.slot2);
    if (type == "revolute" || type == "planar") return axis == Lies::along_normal;
    return type == "fixed" || (type == "translational" && axis == Lies::in_plane);
  }

  const Scene& scene_;
  const MechanismData& data_;
  PlanarModel model_;
  std::vector<int> terms_;  // constraints and laws per row
  bool has_levels_ = false;
};

}  // namespace

void find_planar_model(const Scene& scene, MechanismData& data) {
  data.planar = nullptr;
  int most = -1;
  for (const int normal : {2, 0, 1}) {
    PlanarCompilation search(scene, data, normal);
    std::string why = search.run();
    if (why.empty()) {
      data.planar = std::make_shared<const PlanarModel>(search.take());
      data.not_planar.clear();
      return;
    }
    const int axes = search.axes_along_normal();
    if (axes > most) data.not_planar = std::move(why);
    most = std::max(most, axes);
  }
}

}  // namespace mbsopt
