// The scene compiled at one value of its parameters. Bodies have numbers, joints are primitives, and every numeric
// field is a number with its derivative in rho. It is const after construction. A Dynamics (core/dynamics) owns the
// arrays of a right-hand side.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/scene.hpp"
#include "core/scene/scene_error.hpp"

namespace mbsopt {

class ScenePrograms;   // scene_programs.hpp
struct MechanismData;  // mechanism_data.hpp
struct UserForce;      // core/force/user_force.hpp
struct StatePoint;

class Mechanism {
 public:
  // rho has one value per scene.parameters, in their order. `active[k]` requests derivatives in rho_k (empty: all).
  // `programs` are the scene's expressions, from other mechanisms of the same scene. If null, they are compiled.
  Mechanism(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active = {},
            std::vector<std::shared_ptr<const UserForce>> user_forces = {},
            std::shared_ptr<ScenePrograms> programs = nullptr);
  explicit Mechanism(std::shared_ptr<const MechanismData> data) : data_(std::move(data)) {}

  int bodies() const;  // the ground not counted
  int states() const;  // of y: 14 per body
  int parameters() const;
  const Eigen::VectorXd& rho() const;
  int sensors() const;                        // in the order of scene.sensors
  int sensor(const std::string& name) const;  // index, -1 when there is none

  // Return the value of a sensor at a state. The second adds its gradient: y_bar += scale d/dy, rho_bar += scale
  // d/drho.
  double sensor_value(int sensor, const StatePoint& at) const;
  double add_sensor_gradient(int sensor, const StatePoint& at, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                             Eigen::Ref<Eigen::VectorXd> rho_bar) const;
  // The part of a gradient in accelerations and multipliers waits in at.motion->bar(), where those of several sensors
  // add up, until its fold_bar().
  double add_unfolded_gradient(int sensor, const StatePoint& at, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                               Eigen::Ref<Eigen::VectorXd> rho_bar) const;
  bool reads_motion(int sensor) const;

  const MechanismData& data() const { return *data_; }

 private:
  std::shared_ptr<const MechanismData> data_;
};

// The motion of one body at a state, for output: origin of the body frame, Euler parameters, velocity of the origin,
// and angular velocity in global components. The columns are x y z e0..e3 vx vy vz wx wy wz.
Eigen::Matrix<double, 13, 1> body_row(const Mechanism& mechanism, int body, const StatePoint& at);

// Counts of equations at the assembled initial state.
struct ModelSummary {
  int bodies = 0, equations = 0, rank = 0, degrees_of_freedom = 0;  // equations: joints' and unit-norm rows
  std::vector<std::string> redundant;  // joints that hold redundant equations, "name (2 of 5)"
  // The unknowns of the equations of motion per body (model_choice.hpp): 3 in the plane, 6 in space. not_planar gives
  // the reason for 6.
  int unknowns_per_body = 6;
  std::string not_planar;
};

}  // namespace mbsopt
