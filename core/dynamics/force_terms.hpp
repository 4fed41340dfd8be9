// The scene's forces inside the equations of motion, without gravity and users' own. They give the loads on each body
// (force in global axes, moment in body axes) with tangent and pull-back.
//
// A force written with sensors, F(t, rho, s(t, y, rho)), is differentiated through them:
//   blocks     F_y = F_s s_y        fields     F' = (F_rho + F_s s_rho) rho'
//   pull-back  y_bar += s_y' F_s' F_bar,    rho_bar += (F_rho + F_s s_rho)' F_bar
//
// Each thread needs its own ForceTerms: it owns the numbers of one evaluation. It allocates nothing after construction.
#pragma once

#include <array>
#include <vector>

#include "core/dynamics/motion_blocks.hpp"

namespace mbsopt {

class ForceTerms {
 public:
  explicit ForceTerms(const MechanismData& data);

  // The state of an evaluation. angles holds the branch of each joint angle, frames those of all bodies after the
  // ground's.
  struct At {
    double t;
    const Eigen::VectorXd& y;
    const Eigen::VectorXd& angles;
    const std::vector<Frame>& frames;
  };
  void add_loads(const At& at, std::vector<Vec<6>>& loads, bool but_springs = false);  // PlanarSprings has those
  // The derivatives of the loads in the state as blocks, and in the directions of fields and parameters with bodies at
  // rest. `units` holds the unit tangents of all bodies after the ground's.
  void mark_units(std::vector<bool>& bodies) const;  // marks those that add_blocks() reads
  // but_torques leaves out torques about hinges and free torques. A free torque is an applied torque with components in
  // global axes that reads no sensor.
  void add_blocks(const At& at, const std::vector<UnitTangents>& units, MotionBlocks& out, bool but_springs = false,
                  bool but_torques = false);
  static bool is_free_torque(const AppliedForce& f) { return f.is_torque && !f.in_body_axes && f.sensors.empty(); }
  // visitor(body, components)
  template <class Visitor>
  void for_each_free_torque(const At& at, Visitor&& visitor) {
    for (const AppliedForce& f : data_.applied)
      if (is_free_torque(f)) visitor(static_cast<std::size_t>(f.body), components(f, at));
  }
  // visitor(body, directions of its components) of those that the block moves
  template <class Visitor>
  void for_each_free_torque_tangent(const At& at, const ParameterBlock& block, Visitor&& visitor) {
    for (const AppliedForce& f : data_.applied) {
      if (!is_free_torque(f) || f.parameters.empty()) continue;
      components_with_gradients(f, at);
      Lanes<3> dc = Lanes<3>::Zero();
      for (const int k : f.parameters) add_input(k, block.direction(k), dc);
      visitor(static_cast<std::size_t>(f.body), dc);
    }
  }
  void add_field_tangent(const At& at, const ParameterBlock& block, std::vector<Lanes<6>>& load_dirs);
  // Adds the gradient of the virtual work sum load'eta. The frames hold eta, which stays fixed.
  void add_pull_back(const At& at, std::vector<FrameBar>& bars, Eigen::Ref<Eigen::VectorXd> y_bar,
                     Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar, bool but_springs = false);
  Law::Scratch& law_scratch() { return law_; }

 private:
  // visitor(force, body1, body2)
  template <class Visitor>
  void for_each(bool but_springs, Visitor&& visitor) const;
  ForceInputs inputs(const At& at) { return {at.t, data_.rho, at.angles, law_}; }
  // Calls tangent(t1, t2, load_dir1, load_dir2) of a force between two bodies in each of their coordinates, and adds
  // the result to its blocks.
  template <class Tangent>
  static void add_pair(std::size_t body1, std::size_t body2, const std::vector<UnitTangents>& units, MotionBlocks& out,
                       Tangent&& tangent);

  void set_inputs(const AppliedForce& force, const At& at);
  Vector3d components(const AppliedForce& force, const At& at);
  Vector3d components_with_gradients(const AppliedForce& force, const At& at);
  void set_gradient(int sensor, const At& at);  // y_bar_ and rho_bar_
  // After components_with_gradients: what a direction of an input adds to those of the components.
  void add_input(int input, const Lanes<1>& direction, Lanes<3>& dc) const {
    for (int i = 0; i < 3; ++i)
      dc.row(i) += gradients_[static_cast<std::size_t>(i)][static_cast<std::size_t>(input)] * direction;
  }

  const MechanismData& data_;
  Law::Scratch law_;
  // Scratch for applied forces: inputs of their programs, gradients of components and of a sensor.
  Program::Scratch program_;
  std::vector<double> inputs_;
  std::array<std::vector<double>, 3> gradients_;
  Eigen::VectorXd y_bar_, rho_bar_;
};

}  // namespace mbsopt
