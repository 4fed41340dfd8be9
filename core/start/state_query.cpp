#include "core/start/state_query.hpp"

#include <algorithm>
#include <stdexcept>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/constraint.hpp"
#include "core/dynamics/acceleration_tangents.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/mechanism/parameter_lanes.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Phiddot itself, without the terms that stabilise it.
FormulationSettings without_stabilisation(FormulationSettings formulation) {
  formulation.omega = 0;
  return formulation;
}

// The body's number, counted from 1.
int number_of(const MechanismData& data, const std::string& body) {
  const auto found = std::find(data.body_names.begin() + 1, data.body_names.end(), body);
  if (found == data.body_names.end()) throw std::invalid_argument("there is no body '" + body + "'");
  return static_cast<int>(found - data.body_names.begin());
}

}  // namespace

struct StateQuery::Equations {
  SpatialDynamics dynamics;
  AssemblyEquations position, velocity;
};

StateQuery::StateQuery(const Mechanism& mechanism, const FormulationSettings& formulation, const StatePoint& at)
    : mechanism_(mechanism),
      data_(mechanism_.data()),
      equations_(new Equations{
          {mechanism, formulation}, {data_, AssemblyLevel::position, at.t}, {data_, AssemblyLevel::velocity, at.t}}),
      t_(at.t),
      y_(at.y),
      angles_(at.angles) {
  SpatialDynamics& dynamics = equations_->dynamics;
  equations_->position.set_angles(angles_);
  equations_->velocity.set_angles(angles_);
  const StateLayout layout{data_.n};
  VectorXd ydot(y_.size());
  if (!dynamics.evaluate(t_, y_, angles_, ydot))
    throw std::invalid_argument("the accelerations of this state cannot be computed");
  a_ = ydot.tail(layout.positions());
  loads_ = dynamics.loads();
  lambda_ = VectorXd::Zero(data_.m + data_.n);
  lambda_.head(data_.m) = dynamics.lambda();
  MotionTerms terms(data_, without_stabilisation(formulation));
  terms.set_motion(t_, y_, angles_, a_, dynamics.lambda());
  phi_ddot_ = VectorXd::Zero(data_.m);
  terms.acceleration_errors(phi_ddot_);
  // The part of the equations along p: 2 p lambda_norm
  const VectorXd rest = Q() - M() * a_ - Phi_q().transpose() * lambda_;
  for (int i = 1; i <= data_.n; ++i) {
    const Vector4d p = y_.segment<4>(layout.p(i));
    lambda_(data_.m + i - 1) = p.dot(rest.segment<4>(layout.p(i))) / (2 * p.squaredNorm());
  }
}

BodyMotion StateQuery::body(const std::string& name) const {
  const StateLayout layout{data_.n};
  const int i = number_of(data_, name);
  BodyMotion m;
  m.r = y_.segment<3>(layout.q(i));
  m.rdot = y_.segment<3>(layout.v(i));
  m.rddot = a_.segment<3>(layout.q(i));
  m.p = y_.segment<4>(layout.p(i));
  m.pdot = y_.segment<4>(layout.pdot(i));
  m.pddot = a_.segment<4>(layout.p(i));
  m.A = mbsopt::A(m.p);
  m.omega = m.A * (2 * G_times(m.p, m.pdot));
  m.omegadot = m.A * (2 * G_times(m.p, m.pddot));
  return m;
}

PointMotion StateQuery::point(const std::string& name, const Eigen::Vector3d& in_body_frame) const {
  const BodyMotion m = body(name);
  const Vector3d s = m.A * (in_body_frame - data_.bodies[at(number_of(data_, name))].com);
  return {m.r + s, m.rdot + m.omega.cross(s), m.rddot + m.omegadot.cross(s) + m.omega.cross(m.omega.cross(s))};
}

Index StateQuery::index(const std::string& body) const { return StateLayout{data_.n}.q(number_of(data_, body)); }

StateQuery::Rows StateQuery::rows(const std::string& name) const {
  Index first = data_.m, end = 0;
  for (const Constraint& c : data_.constraints) {
    const std::string& owner = c.drive >= 0 ? data_.drive_names[at(c.drive)] : data_.joint_names[at(c.joint)];
    if (owner != name) continue;
    first = std::min<Index>(first, c.row);
    end = std::max<Index>(end, c.row + c.rows());
  }
  if (end == 0) throw std::invalid_argument("there is no joint or drive '" + name + "'");
  return {first, end - first};
}

// The conditions on sensors come last and are left out.
VectorXd StateQuery::Phi() const { return equations_->position.values_at(y_).head(lambda_.size()); }
VectorXd StateQuery::Phidot() const { return equations_->velocity.values_at(y_).head(lambda_.size()); }
MatrixXd StateQuery::Phi_q() const {
  return equations_->position.gradients(y_).y.topLeftCorner(lambda_.size(), a_.size());
}

VectorXd StateQuery::Phiddot_v() const {
  const StateLayout layout{data_.n};
  VectorXd out = VectorXd::Zero(lambda_.size());
  out.head(data_.m) = phi_ddot_ - Phi_q().topRows(data_.m) * a_;
  for (int i = 1; i <= data_.n; ++i) out(data_.m + i - 1) = 2 * y_.segment<4>(layout.pdot(i)).squaredNorm();
  return out;
}

MatrixXd StateQuery::M() const {
  const StateLayout layout{data_.n};
  MatrixXd out = MatrixXd::Zero(a_.size(), a_.size());
  for (int i = 1; i <= data_.n; ++i) {
    const BodyData& body = data_.bodies[at(i)];
    const Mat<3, 4> G_p = G(y_.segment<4>(layout.p(i)));
    out.block<3, 3>(layout.q(i), layout.q(i)) = body.mass * Matrix3d::Identity();
    out.block<4, 4>(layout.p(i), layout.p(i)) = 4 * G_p.transpose() * body.J * G_p;
  }
  for (const UserForceData& f : data_.user_forces) {  // z = (rddot, 2 G(p) pddot)
    if (!f.force->inertia()) continue;
    const Eigen::Index q = layout.q(f.bodies.front());
    MatrixXd M_z = MatrixXd::Zero(6, 6);
    Mat<6, 7> z_a = Mat<6, 7>::Identity();
    f.force->inertia()->M(y_.segment<7>(q), data_.rho, M_z);
    z_a.bottomRightCorner<3, 4>() = 2 * G(y_.segment<4>(q + 3));
    out.block<7, 7>(q, q) += z_a.transpose() * M_z * z_a;
  }
  return out;
}

// Q_p = 2 G(p)'(torque in body axes)
VectorXd StateQuery::to_coordinates(const std::vector<Vec<6>>& loads) const {
  const StateLayout layout{data_.n};
  VectorXd out(a_.size());
  int i = 0;
  for (const Vec<6>& load : loads) {
    ++i;
    out.segment<3>(layout.q(i)) = load.head<3>();
    out.segment<4>(layout.p(i)) = 2 * G_transposed_times(y_.segment<4>(layout.p(i)), Vector3d(load.tail<3>()));
  }
  return out;
}

VectorXd StateQuery::Q() const { return to_coordinates(loads_); }

MatrixXd StateQuery::Q_y() {
  const StateLayout layout{data_.n};
  // With z = 0 and lambda = 0 the first equation of MotionTerms is b = f.
  MotionTerms& terms = equations_->dynamics.terms();
  terms.set_motion(t_, y_, angles_, VectorXd::Zero(a_.size()), VectorXd::Zero(data_.m));
  const ParameterBlock none = block_without_parameters(data_);
  MatrixXd out = MatrixXd::Zero(a_.size(), y_.size());
  LaneRows y_dir(y_.size(), kLanes);
  std::vector<Vec<6>> change(loads_.size());
  for (Index first = 0; first < y_.size(); first += kLanes) {
    const Index lanes = std::min<Index>(kLanes, y_.size() - first);
    y_dir.setZero();
    for (Index k = 0; k < lanes; ++k) y_dir(first + k, k) = 1;
    terms.set_tangents(none, y_dir);
    for (Index k = 0; k < lanes; ++k) {
      for (std::size_t i = 0; i < change.size(); ++i) change[i] = terms.b_dir[i].col(k);
      out.col(first + k) = to_coordinates(change);
    }
  }
  int i = 0;
  for (const Vec<6>& load : loads_) {  // 2 G(p')' times the torque
    const Vector3d torque = load.tail<3>();
    const Index p = layout.p(++i);
    for (int k = 0; k < 4; ++k)
      out.block<4, 1>(p, p + k) += 2 * G_transposed_times(Vector4d(Vector4d::Unit(k)), torque);
  }
  return out;
}

MatrixXd StateQuery::K() { return -Q_y().leftCols(a_.size()); }
MatrixXd StateQuery::C() { return -Q_y().rightCols(a_.size()); }

void StateQuery::linearise() {
  if (!equations_->dynamics.linearise(t_, y_, angles_, a_, lambda_.head(data_.m)))
    throw std::invalid_argument("the accelerations of this state have no derivatives");
}

MatrixXd StateQuery::F_y() {
  const Index half = a_.size();
  linearise();
  MatrixXd out = MatrixXd::Zero(2 * half, 2 * half);
  out.topRightCorner(half, half).setIdentity();
  out.bottomRows(half) = acceleration_tangents(equations_->dynamics, MatrixXd::Identity(2 * half, 2 * half));
  return out;
}

MatrixXd StateQuery::F_rho() {
  linearise();
  MatrixXd out = MatrixXd::Zero(y_.size(), mechanism_.parameters());
  out.bottomRows(a_.size()) = acceleration_of_parameters(equations_->dynamics);
  return out;
}

Scene starting_at(const Scene& scene, const Mechanism& mechanism, const VectorXd& y) {
  const MechanismData& data = mechanism.data();
  const StateLayout layout{data.n};
  if (y.size() != mechanism.states() || static_cast<int>(scene.bodies.size()) != data.n)
    throw std::invalid_argument("the state has " + std::to_string(y.size()) + " numbers; the mechanism has " +
                                std::to_string(mechanism.states()));
  Scene out = scene;
  out.conditions.clear();
  out.equilibrium = false;
  int i = 0;
  for (Body& body : out.bodies) {
    ++i;
    const Vector4d p = y.segment<4>(layout.p(i));
    const Vector3d s = mbsopt::A(p) * data.bodies[at(i)].com;  // from the origin
    const Vector3d omega = mbsopt::A(p) * (2 * G_times(p, Vector4d(y.segment<4>(layout.pdot(i)))));
    const Vector3d origin = y.segment<3>(layout.q(i)) - s, velocity = y.segment<3>(layout.v(i)) - omega.cross(s);
    body.position = {origin(0), origin(1), origin(2)};
    body.orientation = EulerParametersField{{p(0), p(1), p(2), p(3)}};
    body.velocity = {velocity(0), velocity(1), velocity(2)};
    body.angular_velocity = {omega(0), omega(1), omega(2)};
  }
  return out;
}

}  // namespace mbsopt
