#include "core/start/model_warnings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/constraint_rows.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/force/forces.hpp"
#include "core/linear/dense.hpp"
#include "core/linear/row_dependence.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/mechanism/reaction_sensor.hpp"
#include "core/mechanism/rounded_loops.hpp"
#include "core/mechanism/sensor_gradient.hpp"
#include "core/sensor/body_at.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {
namespace {

using Eigen::VectorXd;

constexpr double kMassless = 1e-12;    // of an inertia about a principal axis, relative to the body's trace
constexpr double kZeroLength = 1e-9;   // of the mechanism's length
constexpr double kMuchViolated = 0.1;  // of the mechanism's size for points, rad for axes

void add_jacobian(const MechanismData& d, const VectorXd& y, std::vector<SparseEntry>& rows) {
  const StateLayout layout{d.n};
  ConstraintRows J(d);
  J.evaluate(frames_at(y));
  for (const RowGroup& g : d.groups) {
    for (int r = 0; r < g.rows; ++r) {
      for (int k = 0; k < 6; ++k) {
        if (g.body1 > 0) rows.push_back({g.row + r, static_cast<int>(layout.z(g.body1)) + k, J.J1(g.block + r, k)});
        if (g.body2 > 0) rows.push_back({g.row + r, static_cast<int>(layout.z(g.body2)) + k, J.J2(g.block + r, k)});
      }
    }
  }
}

// Directions that neither a joint nor a mass holds: no row of J and no row of the masses, one per principal axis,
// reaches them. For each body: whether it may turn, or only move.
std::map<int, bool> massless_directions(const MechanismData& d, const VectorXd& y) {
  const StateLayout layout{d.n};
  std::vector<SparseEntry> rows;
  int count = d.m;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& b = d.bodies[at(i)];
    const int first = static_cast<int>(layout.z(i));
    for (int k = 0; k < 3 && b.mass > 0; ++k) rows.push_back({count++, first + k, 1});
    const SymmetricEigen principal = symmetric_eigen(b.J);
    for (int k = 0; k < 3; ++k) {
      if (!(principal.values(k) > kMassless * b.J.trace())) continue;
      for (int j = 0; j < 3; ++j) rows.push_back({count, first + 3 + j, principal.vectors(j, k)});
      ++count;
    }
  }
  if (count == d.m + 6 * d.n) return {};  // the usual case costs nothing
  add_jacobian(d, y, rows);
  std::map<int, bool> bodies;
  for (const RowDependence::Direction& free : row_dependence(count, d.n, 6, rows, UnitRows::kRankThreshold).unreached) {
    bodies[free.body + 1] = free.column >= 3;
  }
  return bodies;
}

void add_massless(const MechanismData& d, const VectorXd& y, std::vector<std::string>& warnings) {
  for (const auto& [body, turns] : massless_directions(d, y)) {
    warnings.push_back(
        fmt::format("body '{}' has no {} in a direction in which no joint holds it: forces there give no finite "
                    "acceleration; give it "
                    "some, or hold it by a joint",
                    d.body_names[at(body)], turns ? "inertia" : "mass"));
  }
}

void add_springs(const MechanismData& d, const VectorXd& y, std::vector<std::string>& warnings) {
  const double zero = kZeroLength * joint_lengths(d).whole;
  for (const TsdaForce& f : d.forces->of<TsdaForce>()) {
    const double l = f.span(body_at(y, f.body1), body_at(y, f.body2)).l;
    if (l > zero) continue;
    warnings.push_back(fmt::format(
        "a tsda between '{}' and '{}' has zero length at the start, where it has no direction; its force acts "
        "once its points have moved apart",
        d.body_names[at(f.body1)], d.body_names[at(f.body2)]));
  }
}

// The multipliers where all bodies of a planar mechanism spin at 1 rad/s. They show whether products of inertia, forces
// or points at several heights load joints out of the plane.
VectorXd multipliers_of_spin(const Mechanism& mechanism, const AssemblyResult& start) {
  const MechanismData& d = mechanism.data();
  const StateLayout layout{d.n};
  VectorXd y = start.y, ydot(y.size());
  y.tail(layout.positions()).setZero();
  for (int i = 1; i <= d.n; ++i) {
    const Vector4d p = y.segment<4>(layout.p(i));
    y.segment<4>(layout.pdot(i)) = 0.5 * G_transposed_times(p, A(p).transpose() * Vector3d::Unit(d.planar->n));
  }
  SpatialDynamics dynamics(mechanism, {});
  dynamics.evaluate(0, y, start.angles, ydot);
  return dynamics.lambda();
}

// Derivatives of a reaction's components in lambda, one column each. A norm in a planar mechanism has those in the
// plane, and the others only if something loads them: lambda of multipliers_of_spin().
Eigen::MatrixXd by_lambda(const MechanismData& d, ReactionSensor sensor, const VectorXd& y, const VectorXd& lambda) {
  constexpr double kRounding = 1e-9;  // of the largest multiplier
  const bool norm = sensor.component == SensorFunction::kNorm;
  const VectorXd none = VectorXd::Zero(d.m);
  VectorXd y_bar = VectorXd::Zero(y.size()), rho_bar = VectorXd::Zero(d.rho.size());
  SensorGradient to{d, 1, y_bar, rho_bar};
  Eigen::MatrixXd columns(d.m, 0);
  for (int k = 0; k < 3; ++k) {
    if (!norm && k != sensor.component) continue;
    ReactionSensor part = sensor;
    part.component = k;
    VectorXd b = none;
    part.evaluate(d, y, none, &to, &b);
    const bool in_plane = !d.planar || (k == d.planar->n) == sensor.torque;
    const double all = b.lpNorm<Eigen::Infinity>() * lambda.lpNorm<Eigen::Infinity>();
    if (norm && !in_plane && std::abs(b.dot(lambda)) <= kRounding * all) continue;
    columns.conservativeResize(Eigen::NoChange, columns.cols() + 1);
    columns.rightCols(1) = b;
  }
  return columns;
}

// The motion determines J'lambda. It determines b'lambda if b = J u for some u, that is, if b as a further column does
// not raise the rank of J.
void add_reactions(const Mechanism& mechanism, const AssemblyResult& start, std::vector<std::string>& warnings) {
  const MechanismData& d = mechanism.data();
  const VectorXd& y = start.y;
  VectorXd of_spin = VectorXd::Zero(d.m);
  std::vector<SparseEntry> rows;
  int rank = -1;
  std::map<std::string, bool> reported;
  for (const SensorPtr& any : d.sensors) {
    const auto* sensor = dynamic_cast<const ReactionSensor*>(any.get());
    if (!sensor) continue;
    if (rank < 0) {
      add_jacobian(d, y, rows);
      rank = row_dependence(d.m, d.n, 6, rows, UnitRows::kRankThreshold).rank;
    }
    if (rank == d.m) return;
    if (d.planar && sensor->component == SensorFunction::kNorm && of_spin.isZero(0))
      of_spin = multipliers_of_spin(mechanism, start);
    std::vector<SparseEntry> extended = rows;
    const Eigen::MatrixXd b = by_lambda(d, *sensor, y, of_spin);
    for (Eigen::Index k = 0; k < b.cols(); ++k)
      for (int r = 0; r < d.m; ++r)
        if (b(r, k) != 0) extended.push_back({r, 6 * d.n + static_cast<int>(k), b(r, k)});
    if (row_dependence(d.m, d.n + 1, 6, extended, UnitRows::kRankThreshold).rank == rank) continue;
    const std::string what =
        sensor->joint >= 0 ? fmt::format("the {} in joint '{}'", sensor->torque ? "reaction torque" : "reaction force",
                                         d.joint_names[at(sensor->joint)])
                           : std::string("the effort of a drive");
    if (!reported.emplace(what, true).second) continue;
    warnings.push_back(
        fmt::format("{} is not determined: equations of joints depend on each other, and a model of rigid bodies "
                    "cannot tell how the joints share the load. The value is the solution of least size that the "
                    "augmented Lagrangian finds. Derivatives neglect how the shares change, and may be wrong. Use a "
                    "joint with fewer equations instead (`validate` names the redundant ones)",
                    what));
  }
}

// Returns whether the ground holds the centre of mass of every body, so that gravity moves nothing.
bool is_balanced(const MechanismData& d) {
  const double zero = kZeroLength * joint_lengths(d).whole;
  std::vector<bool> held(at(d.n) + 1, false);
  held[0] = true;
  for (const Constraint& c : d.constraints) {
    const auto* p = std::get_if<Coincidence>(&c.primitive);
    if (p && c.body1 == 0 && p->s2.norm() <= zero) held[at(c.body2)] = true;
    if (p && c.body2 == 0 && p->s1.norm() <= zero) held[at(c.body1)] = true;
  }
  return std::all_of(held.begin(), held.end(), [](bool h) { return h; });
}

void add_gravity(const MechanismData& d, std::vector<std::string>& warnings) {
  constexpr double kAlong = 1e-9;  // of gravity: rounding of a component that should be 0
  if (!d.planar) return;
  const Vector3d& g = d.gravity;
  if (std::hypot(g(d.planar->t1), g(d.planar->t2)) > kAlong * g.norm() || g.norm() == 0 || is_balanced(d)) return;
  warnings.push_back(fmt::format(
      "gravity: is [{:g}, {:g}, {:g}] m/s^2, normal to the plane in which the mechanism moves, so it has no effect. "
      "The default is along -z; in a vertical x-y plane it is [0, -9.81, 0]. Set [0, 0, 0] if no gravity is meant",
      g(0), g(1), g(2)));
}

// Warns of an axis in the plane: the angle about it never changes, or jumps by half a turn.
void add_axes(const MechanismData& d, std::vector<std::string>& warnings) {
  if (!d.planar) return;
  constexpr double kAlong = 1 - 1e-9;
  const Vector3d normal = Vector3d::Unit(d.planar->n);
  for (std::size_t k = 0; k < d.sensors.size(); ++k) {
    if (d.sensors[k]->angle() < 0) continue;
    const JointAngle& angle = d.angles[at(d.sensors[k]->angle())];
    if (angle.body1 != 0 || std::abs(angle.measure.s1.cross(angle.measure.s3).dot(normal)) > kAlong) continue;
    warnings.push_back(
        fmt::format("sensors.{}: its axis is not the normal of the plane in which the mechanism moves, [{}, {}, {}]; "
                    "the angle about it does not describe the motion",
                    d.sensor_names[k], normal(0), normal(1), normal(2)));
  }
}

// Coordinates r have a rounding of eps |r|, which counts against the arms of bodies.
void add_rounding(const MechanismData& d, const VectorXd& y, std::vector<std::string>& warnings) {
  constexpr double kNoticeable = 1e-8;  // of the arms: below the tolerances of integrators
  double arm = 0, far = 0;
  for (const Constraint& c : d.constraints) {
    c.for_each_point([&](int body, const Vector3d& s) {
      if (body > 0) arm = std::max(arm, s.norm());
    });
  }
  const StateLayout layout{d.n};
  for (int i = 1; i <= d.n; ++i) far = std::max(far, y.segment<3>(layout.q(i)).stableNorm());
  const double rounding = std::numeric_limits<double>::epsilon() * far;
  if (arm == 0 || !(rounding > kNoticeable * arm)) return;
  warnings.push_back(fmt::format(
      "the bodies are {:.3g} m from the origin, and their joints within {:.3g} m of their centres of mass: rounding of "
      "coordinates is {:.0e} of these lengths, which the motion and its gradients lose. Put the origin near the bodies",
      far, arm, rounding / arm));
}

// Places and turns weigh alike in what is nearest to the guess, so that those of lengths far from 1 m lose digits.
void add_rounding_of_derivatives(const Assembly& assembly, std::vector<std::string>& warnings) {
  constexpr double kNoticeable = 1e-7;  // methods and differences agree to this elsewhere
  const double rounding = assembly.rounding();
  if (!(rounding > kNoticeable)) return;
  warnings.push_back(
      fmt::format("the derivatives of the initial state carry rounding of about {:.0e} of their size, and gradients "
                  "with them: the lengths are far from 1 m. Write the problem in units in which they are near 1",
                  rounding));
}

// The arm of a joint's point that is ten times longer than all other arms: a length in mm where m is read.
std::string hint_of_long_arm(const MechanismData& d, int joint) {
  constexpr double kTimes = 10;
  double arm = 0, others = 0;
  int owner = 0;
  for (const Constraint& c : d.constraints) {
    c.for_each_point([&](int body, const Vector3d& s) {
      if (body > 0 && c.joint == joint && s.norm() > arm)
        others = std::max(others, arm), arm = s.norm(), owner = body;
      else if (body > 0)
        others = std::max(others, s.norm());
    });
  }
  if (!(others > 0 && arm > kTimes * others)) return "";
  return fmt::format(
      "; its point lies {:.3g} m from the centre of mass of '{}', and no other farther than {:.3g} m: "
      "is it in mm? Write the unit, as in \"{:.3g} [mm]\"",
      arm, d.body_names[at(owner)], others, arm);
}

void add_violations(const MechanismData& d, std::vector<std::string>& warnings) {
  double size = 0;
  for (const Constraint& c : d.constraints) {
    if (const auto* p = std::get_if<Coincidence>(&c.primitive)) size = std::max({size, p->s1.norm(), p->s2.norm()});
  }
  VectorXd guess = VectorXd::Zero(StateLayout{d.n}.size());
  guess.head(guess.size() / 2) = position_guess(d);
  const std::vector<Frame> frames = frames_at(guess);
  std::map<int, double> worst_point, worst_axis;
  for (const Constraint& c : d.constraints) {
    if (c.joint < 0) continue;
    if (const auto* p = std::get_if<Coincidence>(&c.primitive)) {
      Vec<3> phi;
      p->phi(frames[at(c.body1)], frames[at(c.body2)], phi);
      worst_point[c.joint] = std::max(worst_point[c.joint], phi.stableNorm());
    } else if (const auto* x = std::get_if<Dot1>(&c.primitive)) {
      Vec<1> phi;
      x->phi(frames[at(c.body1)], frames[at(c.body2)], phi);
      worst_axis[c.joint] = std::max(worst_axis[c.joint], std::abs(phi(0)));
    }
  }
  for (const auto& [joint, amount] : worst_point) {
    if (amount <= kMuchViolated * size || size == 0) continue;
    warnings.push_back(fmt::format(
        "the guess (position, orientation of the bodies) leaves the points of joint '{}' {:.3g} m apart; "
        "check that the assembled position is the one that is meant (`simulate` writes a report with a drawing){}",
        d.joint_names[at(joint)], amount, hint_of_long_arm(d, joint)));
  }
  for (const auto& [joint, amount] : worst_axis) {
    if (amount <= kMuchViolated) continue;
    warnings.push_back(fmt::format(
        "the guess (orientation of the bodies) leaves the axes of joint '{}' {:.3g} rad out of line; check in "
        "the report that the assembled position is the one that is meant",
        d.joint_names[at(joint)], std::asin(std::min(1.0, amount))));
  }
}

}  // namespace

std::vector<std::string> model_warnings(const Mechanism& mechanism, const Assembly& assembly) {
  const MechanismData& d = mechanism.data();
  std::vector<std::string> warnings;
  add_violations(d, warnings);
  add_gravity(d, warnings);
  add_axes(d, warnings);
  for (std::string& warning : start_warnings(mechanism, assembly)) warnings.push_back(std::move(warning));
  return warnings;
}

std::vector<int> massless_bodies(const Mechanism& mechanism, const Assembly& assembly) {
  if (!assembly.result().ok) return {};
  return massless_bodies(mechanism.data(), assembly.result().y);
}

std::vector<int> massless_bodies(const MechanismData& data, const VectorXd& y) {
  std::vector<int> bodies;
  for (const auto& [body, turns] : massless_directions(data, y)) bodies.push_back(body);
  return bodies;
}

std::vector<std::string> start_warnings(const Mechanism& mechanism, const Assembly& assembly) {
  const MechanismData& d = mechanism.data();
  std::vector<std::string> warnings;
  if (!assembly.result().ok) return warnings;
  const VectorXd& y = assembly.result().y;
  if (!d.rounded.joints.empty()) warnings.push_back(in_words(d));
  add_rounding(d, y, warnings);
  add_massless(d, y, warnings);
  add_springs(d, y, warnings);
  add_reactions(mechanism, assembly.result(), warnings);
  add_rounding_of_derivatives(assembly, warnings);
  if (std::string warning = assembly.equilibrium_warning(); !warning.empty()) warnings.push_back(std::move(warning));
  return warnings;
}

}  // namespace mbsopt
