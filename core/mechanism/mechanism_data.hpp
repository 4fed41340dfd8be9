// The numbers of a compiled mechanism. Every field that depends on an active parameter owns rows ("slots") of
// theta_rho, its derivative. A field without a slot (-1) is constant and costs nothing.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/constraint/time_law.hpp"
#include "core/expression/curve.hpp"
#include "core/force/applied.hpp"
#include "core/force/bound_force.hpp"
#include "core/force/force_inputs.hpp"
#include "core/mechanism/sensor_function.hpp"
#include "core/sensor/joint_measure.hpp"

namespace mbsopt {

struct BodyData {
  double mass = 0;                                 // [kg]
  Matrix3d J = Matrix3d::Zero();                   // about the centre of mass, body axes [kg m^2]
  Vector3d com = Vector3d::Zero();                 // in the body frame [m]
  int slot_mass = -1, slot_J = -1, slot_com = -1;  // slot_J: xx yy zz xy xz yz
  // The guess of the initial state.
  Vec<7> q = Vec<7>::Zero();                                                  // (r_g, p)
  Vector3d velocity = Vector3d::Zero(), angular_velocity = Vector3d::Zero();  // of the body-frame origin; global
  int slot_q = -1, slot_velocity = -1, slot_angular_velocity = -1;
};

// Consecutive rows of Phi that tie the same two bodies, and their Jacobian blocks.
struct RowGroup {
  int body1 = 0, body2 = 0, row = 0, block = 0, rows = 0;
  bool shared = false;  // one row that other groups contribute to as well
};

struct RowLaw {
  int row = 0;
  TimeLaw law;
  int drive = -1;  // index in the scene of the drive that it belongs to
};

// A value that the initial state gives to a sensor, or to its rate.
struct ConditionData {
  int sensor = 0;
  bool of_velocities = false, of_rate = false;
  SensorPtr measured;  // the sensor, or its rate
  SensorPtr rate;      // the time derivative of `measured`; of velocities `measured` itself
  double value = 0;
  int slot = -1;
  std::string unit{};  // " rad", " rad/s"; empty for a number
};

struct KinkedSignal {  // a derivative jumps at its samples, later by the delay
  std::shared_ptr<const Curve> curve;
  double delay = 0;
  std::vector<int>
      moved_by;   // parameters that move jumps and kinks; not those of higher derivatives, which matter less
  int order = 0;  // of that derivative: 0 of hold, 1 of linear, 3 of spline, less of their derivatives
};

// One bound of a limit: the gap s - lower or upper - s of a sensor s never is negative.
struct LimitData {
  std::string name;
  Program gap;       // inputs: all parameters, t, all sensors
  int sign = 1;      // of s in the gap
  ForcePlace force;  // a constant force along the gradient of s, which is 0 but for impulses
  double e = 0;      // restitution
  int slot_e = -1;
};

struct UserForceData {
  std::shared_ptr<const BoundForce> force;
  std::vector<int> bodies;  // 1-based
};

// The changes of points and axes with which redundant equations of loops agree (rounded_loops.hpp).
struct RoundedLoops {
  std::vector<int> joints;     // indices of those that change; empty: the equations agree
  double shift = 0, turn = 0;  // the largest [m], [rad]
  double part = 0;             // the largest of turns, and of shifts in lengths of the mechanism
  bool made = false;           // part is within simulation.redundancy_tolerance
};

class ScenePrograms;  // scene_programs.hpp
struct Scene;         // core/scene/scene.hpp
struct Constraint;    // core/constraint/constraint.hpp
struct Forces;        // core/force/forces.hpp
struct PlanarModel;   // planar_model.hpp

// Headers of the kinds of constraints and forces stay out, so that a change to one recompiles only what computes with
// it.
struct MechanismData {
  MechanismData();
  MechanismData(const MechanismData& other);
  MechanismData(MechanismData&& other) noexcept;
  MechanismData& operator=(const MechanismData& other) = delete;
  ~MechanismData();

  int n = 0;                  // bodies, the ground not counted
  int m = 0;                  // rows of Phi, unit norms not counted
  int blocks = 0;             // Jacobian block rows of all constraints: m, and more where rows are shared
  Eigen::VectorXd rho;        // all parameters
  std::vector<int> active;    // parameters with respect to which derivatives are carried
  Eigen::MatrixXd theta_rho;  // slots x active

  std::vector<BodyData> bodies;  // [0] is the ground
  Vector3d gravity = Vector3d::Zero();
  int slot_gravity = -1;
  std::vector<Constraint> constraints;
  std::vector<RowLaw> laws;
  Eigen::VectorXd row_alpha;  // per row: alpha of the augmented Lagrangian per unit of its relative alpha
  std::vector<RowGroup> groups;
  std::vector<JointAngle> angles;
  std::shared_ptr<Forces> forces;  // copies share them
  std::vector<AppliedForce> applied;
  std::vector<UserForceData> user_forces;
  std::vector<LimitData> limits;
  std::vector<SensorPtr> sensors;
  std::vector<std::string> sensor_names;
  std::vector<ConditionData> conditions;
  std::vector<std::string> body_names, joint_names, drive_names;  // body_names[0] = "ground"
  std::vector<KinkedSignal> kinks;                                // of signals and laws
  int largest_law = 0;                                            // inputs of the largest law, for scratch

  std::shared_ptr<const PlanarModel> planar;  // set if joints hold all bodies in a plane
  std::string not_planar;                     // else why not

  bool needs_motion = false;    // some sensor does
  bool equilibrium = false;     // start from static equilibrium
  int assembly_iterations = 0;  // at most
  Eigen::VectorXd row_size;     // per row: the mechanism's length for a length [m], else 1
  RoundedLoops rounded;

  Eigen::Index slots() const { return theta_rho.rows(); }
  // rho_bar (all parameters) += (d theta/d rho)' theta_bar
  void add_to_rho(const Eigen::VectorXd& theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
    for (std::size_t k = 0; k < active.size(); ++k) {
      rho_bar(active[k]) += theta_rho.col(static_cast<Eigen::Index>(k)).dot(theta_bar);
    }
  }
};

// Compiles a scene. Throws SceneError with the place in the scene. `programs` are those of this scene, or null.
MechanismData compile(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                      std::vector<std::shared_ptr<const UserForce>> user_forces,
                      std::shared_ptr<ScenePrograms> programs = nullptr);

struct Energy {
  double kinetic = 0, potential = 0;
};
// The potential is that of gravity, zero at the origin, and of springs with constant coefficients.   [J]
Energy energy(const MechanismData& data, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
// Returns whether only gravity and springs of known potential do work.
bool conserves_energy(const MechanismData& data);

}  // namespace mbsopt
