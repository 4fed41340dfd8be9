// The numbers of a compiled mechanism. Every field that depends on an active parameter owns rows ("slots") of
// theta_rho, its derivative; a field without a slot (-1) is constant and costs nothing.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/constraint/constraint.hpp"
#include "core/constraint/time_law.hpp"
#include "core/force/applied.hpp"
#include "core/force/forces.hpp"
#include "core/force/user_force.hpp"
#include "core/sensor/acceleration_sensor.hpp"
#include "core/sensor/joint_measure.hpp"
#include "core/sensor/point_sensor.hpp"
#include "core/sensor/rotation_sensor.hpp"

namespace mbsopt {

struct BodyData {
  double mass = 0;                                 // [kg]
  Matrix3d J = Matrix3d::Zero();                   // about the centre of mass, body axes [kg m^2]
  Vector3d com = Vector3d::Zero();                 // in the body frame [m]
  int slot_mass = -1, slot_J = -1, slot_com = -1;  // slot_J: xx yy zz xy xz yz
  // Guess of the initial state.
  Vec<7> q = Vec<7>::Zero();                                                  // (r_g, p)
  Vector3d velocity = Vector3d::Zero(), angular_velocity = Vector3d::Zero();  // of the body-frame origin; global
  int slot_q = -1, slot_velocity = -1, slot_angular_velocity = -1;
};

struct AngleSensor {
  int angle = 0;  // index of the JointAngle
  bool rate = false;
};
struct EnergySensor {
  bool kinetic = true, potential = true;
};
struct ReactionSensor {  // reaction_sensor.hpp
  int joint = -1;        // index in the scene
  bool torque = false;
  int component = 0;  // 0..2, or PointSensor::kNorm
  int body2 = 0;
  Vector3d s2 = Vector3d::Zero();  // the joint's point on body 2, from its centre of mass
  int slot_s2 = -1;
  int drive_row = -1;  // of a drive's effort: its row of Phi
};
struct ViolationSensor {};   // the largest |Phi| of joints and unit norms
struct DisplacementSensor {  // along a joint's axis, or its rate
  JointDisplacement joint;
  bool rate = false;
};
struct TensionSensor {  // what the law of a force says: a tsda pulls so [N], an rsda resists so [N m]
  Forces::Place place;
};

using SensorKind = std::variant<PointSensor, AngularVelocitySensor, CoordinateSensor, AngleSensor, EnergySensor,
                                ViolationSensor, TensionSensor, DisplacementSensor, AccelerationSensor, ReactionSensor>;

// Consecutive rows of Phi that tie the same two bodies, and their Jacobian blocks.
struct RowGroup {
  int body1 = 0, body2 = 0, row = 0, block = 0, rows = 0;
  bool shared = false;  // one row that other groups contribute to as well
};

struct RowLaw {
  int row = 0;
  TimeLaw law;
};

struct ConditionData {
  int sensor = 0;
  SensorKind rate_kind;  // the sensor's time derivative, where rate is set
  bool has_value = false, has_rate = false, modulo_turn = false, velocity_level = false;
  double value = 0, rate = 0;
  int slot_value = -1, slot_rate = -1;
};

struct UserForceData {
  std::shared_ptr<const UserForce> force;
  std::vector<int> bodies;  // 1-based
};

struct PlanarModel;  // planar_model.hpp

struct MechanismData {
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
  Forces forces;
  std::vector<AppliedForce> applied;
  std::vector<UserForceData> user_forces;
  std::vector<SensorKind> sensors;
  std::vector<std::string> sensor_names;
  std::vector<ConditionData> conditions;
  std::vector<std::string> body_names, joint_names, drive_names;  // body_names[0] = "ground"
  int largest_law = 0;                                            // inputs of the largest law, for scratch

  std::shared_ptr<const PlanarModel> planar;  // where joints hold all bodies in a plane
  std::string not_planar;                     // else why not

  bool needs_motion = false;  // some sensor does
  bool equilibrium = false;   // start from static equilibrium

  Eigen::Index slots() const { return theta_rho.rows(); }
  // rho_bar (all parameters) += (d theta/d rho)' theta_bar
  void add_to_rho(const Eigen::VectorXd& theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar) const {
    for (std::size_t k = 0; k < active.size(); ++k) {
      rho_bar(active[k]) += theta_rho.col(static_cast<Eigen::Index>(k)).dot(theta_bar);
    }
  }
};

// rho_bar (all parameters) += scale (d slot/d rho)' bar, for one field
template <int N>
void add_slot(const MechanismData& data, int slot, const Vec<N>& bar, double scale,
              Eigen::Ref<Eigen::VectorXd> rho_bar) {
  FieldGradient{data.theta_rho, data.active, scale, rho_bar}.add<N>(slot, bar);
}

// Value of a sensor at (y, branch of the angles), and its gradient: y_bar += scale d/dy, and in the fields and
// parameters. rho_bar is with respect to all parameters.
double evaluate(const MechanismData& data, const SensorKind& sensor, double t, const Eigen::VectorXd& y,
                const Eigen::VectorXd& angles);
double add_gradient(const MechanismData& data, const SensorKind& sensor, double t, const Eigen::VectorXd& y,
                    const Eigen::VectorXd& angles, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                    Eigen::Ref<Eigen::VectorXd> rho_bar);

struct StatePoint;  // state_point.hpp
// The same for any sensor; one that needs the motion takes it from the point.
double evaluate(const MechanismData& data, const SensorKind& sensor, const StatePoint& at);
double add_gradient(const MechanismData& data, const SensorKind& sensor, const StatePoint& at, double scale,
                    Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::Ref<Eigen::VectorXd> rho_bar);

// Whether a sensor needs the solution of the equations of motion; such a one is evaluated with a StatePoint that has
// it.
inline bool needs_motion(const SensorKind& sensor) {
  return std::holds_alternative<AccelerationSensor>(sensor) || std::holds_alternative<ReactionSensor>(sensor);
}

struct Energy {
  double kinetic = 0, potential = 0;
};
// Potential: gravity's, zero at the origin, and that of springs with constant coefficients.   [J]
Energy energy(const MechanismData& data, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);
// Whether nothing does work but gravity and springs, whose potential is known.
bool conserves_energy(const MechanismData& data);

}  // namespace mbsopt
