// The scene compiled at one value of its parameters: bodies numbered, joints turned into primitives, every numeric
// field a number with its derivative in rho. It is const after construction; a Dynamics (core/dynamics)
// owns the arrays of a right-hand side.
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
  // rho: one value per scene.parameters, in their order. active[k]: whether derivatives in rho_k are wanted (empty:
  // all). programs: the scene's expressions, from other mechanisms of the same scene; null: they are compiled.
  Mechanism(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active = {},
            std::vector<std::shared_ptr<const UserForce>> user_forces = {},
            std::shared_ptr<ScenePrograms> programs = nullptr);

  int bodies() const;  // the ground not counted
  int states() const;  // of y: 14 per body
  int parameters() const;
  const Eigen::VectorXd& rho() const;
  int sensors() const;                        // in the order of scene.sensors
  int sensor(const std::string& name) const;  // index, -1 when there is none

  // Value of a sensor at a state, and with its gradient: y_bar += scale d/dy, rho_bar += scale d/drho.
  double sensor_value(int sensor, const StatePoint& at) const;
  double add_sensor_gradient(int sensor, const StatePoint& at, double scale, Eigen::Ref<Eigen::VectorXd> y_bar,
                             Eigen::Ref<Eigen::VectorXd> rho_bar) const;

  const MechanismData& data() const { return *data_; }

 private:
  std::shared_ptr<const MechanismData> data_;
};

// Body-frame quantities of one body at a state, for output: origin, Euler parameters, origin's velocity, angular
// velocity (global components): x y z e0..e3 vx vy vz wx wy wz.
Eigen::Matrix<double, 13, 1> body_row(const Mechanism& mechanism, int body, const StatePoint& at);

// Counts of equations at the assembled initial state.
struct ModelSummary {
  int bodies = 0, equations = 0, rank = 0, degrees_of_freedom = 0;  // equations: joints' and unit-norm rows
  std::vector<std::string> redundant;  // joints that hold redundant equations, "name (2 of 5)"
  // Unknowns of the equations of motion (model_choice.hpp): 3 in the plane, 6 in space; and the reason why not 3.
  int unknowns_per_body = 6;
  std::string not_planar;
};

}  // namespace mbsopt
