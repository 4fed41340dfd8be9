#include "core/dynamics/model_warnings.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/dynamics/constraint_rows.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/sensor/body_at.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMassless = 1e-12;      // relative to the largest mass or inertia
constexpr double kZeroLength = 1e-9;     // [m]
constexpr double kMuchViolated = 0.1;    // of the mechanism's size for points, rad for axes
constexpr double kRankThreshold = 1e-8;  // rows of J scaled to unit length

std::size_t at(int i) { return static_cast<std::size_t>(i); }

std::vector<Frame> frames_at(const MechanismData& d, const VectorXd& q) {
  std::vector<Frame> frames(at(d.n) + 1);
  BodyState state;
  for (int i = 1; i <= d.n; ++i) set_position(q.segment<7>(7 * (i - 1)), state, frames[at(i)]);
  return frames;
}

void add_massless(const MechanismData& d, const VectorXd& q, std::vector<std::string>& warnings) {
  bool any = false;
  double mass = 0, inertia = 0;
  for (int i = 1; i <= d.n; ++i) {
    mass = std::max(mass, d.bodies[at(i)].mass), inertia = std::max(inertia, d.bodies[at(i)].J.trace());
  }
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& b = d.bodies[at(i)];
    const double least = Eigen::SelfAdjointEigenSolver<Matrix3d>(b.J, Eigen::EigenvaluesOnly).eigenvalues()(0);
    any = any || b.mass <= kMassless * mass || least <= kMassless * inertia;
  }
  if (!any) return;  // the usual case costs nothing
  ConstraintRows rows(d);
  rows.evaluate(frames_at(d, q));
  MatrixXd J = rows.dense();
  if (d.m == 0) J = MatrixXd::Zero(1, 6 * d.n);
  for (Index r = 0; r < J.rows(); ++r) J.row(r) /= std::max(J.row(r).norm(), 1e-300);
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  qr.setThreshold(kRankThreshold);
  qr.compute(J.transpose());
  const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(6 * d.n, 6 * d.n);
  const MatrixXd N = Q.rightCols(6 * d.n - qr.rank());
  if (N.cols() == 0) return;
  MatrixXd MN = N;
  for (int i = 1; i <= d.n; ++i) {
    MN.middleRows(6 * (i - 1), 3) *= d.bodies[at(i)].mass / (mass > 0 ? mass : 1);
    MN.middleRows(6 * (i - 1) + 3, 3) =
        (d.bodies[at(i)].J / (inertia > 0 ? inertia : 1) * N.middleRows(6 * (i - 1) + 3, 3)).eval();
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(N.transpose() * MN);
  std::map<int, bool> bodies;
  for (Index k = 0; k < N.cols() && eigen.eigenvalues()(k) <= kMassless; ++k) {
    Index row = 0;
    (N * eigen.eigenvectors().col(k)).cwiseAbs().maxCoeff(&row);
    bodies[static_cast<int>(row / 6) + 1] = row % 6 >= 3;
  }
  for (const auto& [body, turns] : bodies) {
    warnings.push_back(
        fmt::format("body '{}' has no {} in a direction in which no joint holds it: forces there give no finite "
                    "acceleration; give it "
                    "some, or hold it by a joint",
                    d.body_names[at(body)], turns ? "inertia" : "mass"));
  }
}

void add_springs(const MechanismData& d, const VectorXd& y, std::vector<std::string>& warnings) {
  for (const TsdaForce& f : d.tsda) {
    const double l = f.span(body_at(y, f.body1).frame, body_at(y, f.body2).frame).l;
    if (l > kZeroLength) continue;
    warnings.push_back(fmt::format(
        "a tsda between '{}' and '{}' has zero length at the start, where it has no direction; its force acts "
        "once its points have moved apart",
        d.body_names[at(f.body1)], d.body_names[at(f.body2)]));
  }
}

// Whether the ground holds the centre of mass of every body: then no gravity moves anything.
bool is_balanced(const MechanismData& d) {
  std::vector<bool> held(at(d.n) + 1, false);
  held[0] = true;
  for (const Constraint& c : d.constraints) {
    const auto* p = std::get_if<Coincidence>(&c.primitive);
    if (p && c.body1 == 0 && p->s2.norm() <= kZeroLength) held[at(c.body2)] = true;
    if (p && c.body2 == 0 && p->s1.norm() <= kZeroLength) held[at(c.body1)] = true;
  }
  return std::all_of(held.begin(), held.end(), [](bool h) { return h; });
}

void add_gravity(const MechanismData& d, std::vector<std::string>& warnings) {
  constexpr double kAlong = 1e-9;  // of gravity: what rounding leaves of a component that is meant to be 0
  if (!d.planar) return;
  const Vector3d& g = d.gravity;
  if (std::hypot(g(d.planar->t1), g(d.planar->t2)) > kAlong * g.norm() || g.norm() == 0 || is_balanced(d)) return;
  warnings.push_back(
      fmt::format("gravity: is [{:g}, {:g}, {:g}] m/s^2, normal to the plane in which the mechanism moves: it moves "
                  "nothing. The default is along -z; in a vertical x-y plane it is [0, -9.81, 0]. [0, 0, 0] says that "
                  "none is meant",
                  g(0), g(1), g(2)));
}

void add_violations(const MechanismData& d, std::vector<std::string>& warnings) {
  double size = 0;
  for (const Constraint& c : d.constraints) {
    if (const auto* p = std::get_if<Coincidence>(&c.primitive)) size = std::max({size, p->s1.norm(), p->s2.norm()});
  }
  VectorXd q(7 * d.n);
  for (int i = 1; i <= d.n; ++i) q.segment<7>(7 * (i - 1)) = d.bodies[at(i)].q;
  const std::vector<Frame> frames = frames_at(d, q);
  std::map<int, double> worst_point, worst_axis;
  for (const Constraint& c : d.constraints) {
    if (c.joint < 0) continue;
    if (const auto* p = std::get_if<Coincidence>(&c.primitive)) {
      Vec<3> phi;
      p->phi(frames[at(c.body1)], frames[at(c.body2)], phi);
      worst_point[c.joint] = std::max(worst_point[c.joint], phi.norm());
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
        "check that the assembled position is the one that is meant (`simulate` writes a report with a drawing)",
        d.joint_names[at(joint)], amount));
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
  for (std::string& warning : start_warnings(mechanism, assembly)) warnings.push_back(std::move(warning));
  return warnings;
}

std::vector<std::string> start_warnings(const Mechanism& mechanism, const Assembly& assembly) {
  const MechanismData& d = mechanism.data();
  std::vector<std::string> warnings;
  if (!assembly.result().ok) return warnings;
  add_massless(d, assembly.result().y.head(7 * d.n), warnings);
  add_springs(d, assembly.result().y, warnings);
  return warnings;
}

}  // namespace mbsopt
