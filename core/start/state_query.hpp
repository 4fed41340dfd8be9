// The equations of motion at a state, by the names of bodies, joints and drives. Coordinates are q = (r_g, p), 7
// numbers per body in the order of the scene. The rows of Phi are those of joints and drives, then p'p - 1 of each
// body.
//
//   M qddot + Phi_q'lambda = Q,   Phi_q qddot + Phiddot_v = 0        Q: forces, gravity, -omega x J omega
//   Phi_q v + Phi_t = Phidot,     K = -dQ/dq,   C = -dQ/dv           (the textbooks' gamma is -Phiddot_v)
//   ydot = F(y, rho):  F_y = [0 I; a_q a_v],   F_rho = [0; a_rho]    derivatives of the constrained equations
//
//   const Assembly assembly(mechanism, 0);                           // or the StatePoint of an observer
//   const StateQuery at(mechanism, formulation, {0, assembly.result().y, assembly.result().angles});
//   at.point("crank", {0.3, 0, 0}).acceleration;                     // global, of the point at 0.3 m in the body frame
//   at.Phi_q().middleRows(at.rows("pin").first, at.rows("pin").count);
//
// Matrices are dense and computed on demand; Eigen's sparseView() makes sparse ones.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/mechanism/state_point.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct BodyMotion {
  Eigen::Vector3d r, rdot, rddot;   // of the centre of mass, global
  Eigen::Matrix3d A;                // from body axes to global ones
  Eigen::Vector4d p, pdot, pddot;   // Euler parameters
  Eigen::Vector3d omega, omegadot;  // angular velocity and acceleration, global
};

struct PointMotion {
  Eigen::Vector3d position, velocity, acceleration;  // global
};

class StateQuery {
 public:
  // Throws std::invalid_argument if the accelerations cannot be computed.
  StateQuery(const Mechanism& mechanism, const FormulationSettings& formulation, const StatePoint& at);

  // Unknown names throw std::invalid_argument.
  BodyMotion body(const std::string& name) const;
  PointMotion point(const std::string& body, const Eigen::Vector3d& in_body_frame) const;
  Eigen::Index index(const std::string& body) const;  // the index of its first number in q
  struct Rows {
    Eigen::Index first = 0, count = 0;
  };
  Rows rows(const std::string& joint_or_drive) const;  // in Phi

  const Eigen::VectorXd& qddot() const { return a_; }
  const Eigen::VectorXd& lambda() const { return lambda_; }  // with those of the unit norms
  Eigen::VectorXd Phi() const;
  Eigen::VectorXd Phidot() const;
  Eigen::VectorXd Phiddot_v() const;
  Eigen::MatrixXd Phi_q() const;
  Eigen::MatrixXd M() const;  // diag(m I, 4 G'J G) and mass terms of users: without an entry for changes of |p|
  Eigen::VectorXd Q() const;
  Eigen::MatrixXd K();
  Eigen::MatrixXd C();
  Eigen::MatrixXd F_y();
  Eigen::MatrixXd F_rho();

 private:
  Eigen::MatrixXd Q_y();  // 7n x 14n
  void linearise();       // at the motion
  Eigen::VectorXd to_coordinates(const std::vector<Vec<6>>& loads) const;

  const Mechanism mechanism_;
  const MechanismData& data_;
  struct Equations;
  std::shared_ptr<Equations> equations_;
  double t_;
  Eigen::VectorXd y_, angles_, a_, lambda_, phi_ddot_;
  std::vector<Vec<6>> loads_;  // in (rddot, omegadot)
};

// The scene with the state y as the guess of its start, without initial.conditions. If y satisfies the constraints, the
// next run begins there. mechanism is that of y.
Scene starting_at(const Scene& scene, const Mechanism& mechanism, const Eigen::VectorXd& y);

}  // namespace mbsopt
