#include "bench/linkage.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "core/scene/scene.hpp"

namespace mbsopt::bench {
namespace {

constexpr double kOwnAxis = 1e-3;  // moment of inertia of a rod about itself, where a case says nothing [kg m^2]

Linkage::Rod rod_between(const Vector3d& from, const Vector3d& to, double own_axis) {
  const Vector3d along = (to - from).normalized().cwiseAbs();
  Linkage::Rod rod;
  rod.centre = 0.5 * (from + to);
  rod.inertia = Vector3d::Constant((to - from).squaredNorm() / 12);
  rod.inertia += (own_axis - rod.inertia(0)) * along;
  return rod;
}

// Hangs a rod on a body that is there already, turning against it at a rate about the hinge.
void hang(Linkage& linkage, int parent, const Vector3d& from, const Vector3d& to, const Vector3d& axis, double rate) {
  Linkage::Rod rod = rod_between(from, to, kOwnAxis);
  const Vector3d omega_parent = linkage.omega(parent);
  Vector3d velocity = Vector3d::Zero();  // of the hinge
  if (parent != Linkage::kGround) {
    velocity = linkage.rod(parent).velocity + omega_parent.cross(from - linkage.centre(parent));
  }
  rod.omega = omega_parent + rate * axis;
  rod.velocity = velocity + rod.omega.cross(rod.centre - from);
  linkage.rods.push_back(rod);
  linkage.hinges.push_back({parent, linkage.size() - 1, from, axis});
}

double rate_of(int rod) { return 0.1 * std::sin(rod + 1.0); }

}  // namespace

bool Linkage::planar() const {
  for (const Hinge& hinge : hinges) {
    if (hinge.axis != Vector3d::UnitZ()) return false;
  }
  return true;
}

Linkage planar_chain(int rods) {
  Linkage chain;
  Vector3d from = Vector3d::Zero();
  for (int i = 0; i < rods; ++i) {
    const Vector3d to = from + (i % 2 == 0 ? Vector3d(1, 0, 0) : Vector3d(0, -1, 0));
    hang(chain, i - 1, from, to, Vector3d::UnitZ(), rate_of(i));
    from = to;
  }
  return chain;
}

Linkage spatial_chain(int rods) {
  Linkage chain;
  Vector3d from = Vector3d::Zero();
  for (int i = 0; i < rods; ++i) {
    const Vector3d to = from + Vector3d::Unit(i % 3);
    hang(chain, i - 1, from, to, Vector3d::Unit((i + 1) % 3), rate_of(i));
    from = to;
  }
  return chain;
}

Linkage tree(int rods) {
  Linkage tree;
  std::vector<Vector3d> ends;
  for (int i = 0; i < rods; ++i) {
    const int parent = i == 0 ? Linkage::kGround : (i - 1) / 2;
    const Vector3d from = i == 0 ? Vector3d::Zero() : ends[static_cast<std::size_t>(parent)];
    const Vector3d to = from + Vector3d::Unit(i % 3);
    hang(tree, parent, from, to, Vector3d::Unit((i + 1) % 3), rate_of(i));
    ends.push_back(to);
  }
  return tree;
}

// ../shared/cases.md, A02, and problems/four_bar/windows.json (N = 2).
Linkage four_bars(int windows) {
  Linkage linkage;
  const Vector3d z = Vector3d::UnitZ(), up = Vector3d::UnitY();
  const auto foot = [](int i) { return Vector3d(i, 0, 0); };
  for (int i = 0; i <= windows; ++i) {
    Linkage::Rod crank = rod_between(foot(i), foot(i) + up, kOwnAxis);
    crank.velocity = {0.5, 0, 0}, crank.omega = {0, 0, -1};
    linkage.rods.push_back(crank);
    linkage.hinges.push_back({Linkage::kGround, i, foot(i), z});
  }
  for (int i = 1; i <= windows; ++i) {
    Linkage::Rod coupler = rod_between(foot(i - 1) + up, foot(i) + up, kOwnAxis);
    coupler.velocity = {1, 0, 0};
    linkage.rods.push_back(coupler);
    linkage.hinges.push_back({i - 1, windows + i, foot(i - 1) + up, z});
    linkage.hinges.push_back({windows + i, i, foot(i) + up, z});
  }
  return linkage;
}

Linkage bricard() {
  const Vector3d P[] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  Linkage linkage;
  for (int i = 0; i < 5; ++i) linkage.rods.push_back(rod_between(P[i], P[i + 1], 1e-9));
  linkage.hinges = {{Linkage::kGround, 0, P[0], y}, {0, 1, P[1], z}, {1, 2, P[2], x}, {2, 3, P[3], y}, {3, 4, P[4], z},
                    {Linkage::kGround, 4, P[5], x}};
  return linkage;
}

// chi'' = a sin chi, chi(0) = 0, chi'(0) = 1, a = 3 (3N + 1) g/(2 (4N + 1) L), by the classical Runge-Kutta method at
// steps whose error is below 1e-12.
std::vector<double> four_bars_angles(int windows, const std::vector<double>& times) {
  const double a = 3 * (3.0 * windows + 1) * 9.81 / (2 * (4.0 * windows + 1));
  double t = 0, chi = 0, rate = 1;
  std::vector<double> angles;
  for (const double next : times) {
    const int steps = static_cast<int>(std::ceil((next - t) / 1e-4));
    const double h = steps > 0 ? (next - t) / steps : 0;
    for (int i = 0; i < steps; ++i) {
      const double k1 = rate, l1 = a * std::sin(chi);
      const double k2 = rate + h / 2 * l1, l2 = a * std::sin(chi + h / 2 * k1);
      const double k3 = rate + h / 2 * l2, l3 = a * std::sin(chi + h / 2 * k2);
      const double k4 = rate + h * l3, l4 = a * std::sin(chi + h * k3);
      chi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      rate += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
    }
    t = next;
    angles.push_back(chi);
  }
  return angles;
}

SpanningTree spanning_tree(const Linkage& linkage) {
  SpanningTree tree;
  std::vector<bool> reached(linkage.rods.size(), false), used(linkage.hinges.size(), false);
  std::vector<std::vector<int>> hinges_at(linkage.rods.size() + 1);  // [0]: the ground's
  for (std::size_t k = 0; k < linkage.hinges.size(); ++k) {
    for (const int body : {linkage.hinges[k].body1, linkage.hinges[k].body2})
      hinges_at[static_cast<std::size_t>(body + 1)].push_back(static_cast<int>(k));
  }
  std::vector<int> queue{Linkage::kGround};
  for (std::size_t next = 0; next < queue.size(); ++next) {
    const int parent = queue[next];
    for (const int k : hinges_at[static_cast<std::size_t>(parent + 1)]) {
      const Linkage::Hinge& hinge = linkage.hinges[static_cast<std::size_t>(k)];
      const int rod = hinge.body1 == parent ? hinge.body2 : hinge.body1;
      if (rod == Linkage::kGround || reached[static_cast<std::size_t>(rod)]) continue;
      reached[static_cast<std::size_t>(rod)] = used[static_cast<std::size_t>(k)] = true;
      tree.branches.push_back({parent, rod, k});
      queue.push_back(rod);
    }
  }
  for (std::size_t k = 0; k < used.size(); ++k) {
    if (!used[k]) tree.closing.push_back(static_cast<int>(k));
  }
  return tree;
}

Scene scene_of(const Linkage& linkage) {
  const auto field = [](const Vector3d& x) { return VectorField{x(0), x(1), x(2)}; };
  const auto name = [](int body) { return body == Linkage::kGround ? "ground" : "rod" + std::to_string(body); };
  Scene scene;
  scene.gravity = field(linkage.gravity);
  for (int i = 0; i < linkage.size(); ++i) {
    const Linkage::Rod& rod = linkage.rod(i);
    Body body;
    body.name = name(i), body.mass = rod.mass;
    body.inertia = {rod.inertia(0), rod.inertia(1), rod.inertia(2), 0.0, 0.0, 0.0};
    body.position = field(rod.centre);
    body.velocity = field(rod.velocity), body.angular_velocity = field(rod.omega);
    scene.bodies.push_back(body);
  }
  for (std::size_t k = 0; k < linkage.hinges.size(); ++k) {
    const Linkage::Hinge& hinge = linkage.hinges[k];
    Joint joint;
    joint.name = "hinge" + std::to_string(k), joint.type = "revolute";
    joint.body1 = name(hinge.body1), joint.body2 = name(hinge.body2);
    joint.point1 = field(hinge.point - linkage.centre(hinge.body1));
    joint.point2 = field(hinge.point - linkage.centre(hinge.body2));
    joint.axis1 = joint.axis2 = field(hinge.axis);
    scene.joints.push_back(joint);
  }
  return scene;
}

Eigen::VectorXd start_of(const Linkage& linkage) {
  const Eigen::Index n = linkage.size();
  Eigen::VectorXd y = Eigen::VectorXd::Zero(14 * n);
  for (int i = 0; i < n; ++i) {
    const Linkage::Rod& rod = linkage.rod(i);
    y.segment<3>(7 * i) = rod.centre;
    y(7 * i + 3) = 1;
    y.segment<3>(7 * (n + i)) = rod.velocity;
    y.segment<3>(7 * (n + i) + 4) = 0.5 * rod.omega;
  }
  return y;
}

}  // namespace mbsopt::bench
