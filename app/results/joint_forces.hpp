// The force of each joint on its second body, at some instants of a run, for the arrows of a report. Columns: t, then
// per joint its force in global axes [N].
//
//   JointForces forces(scene, rho, sampling.times.size());
//   sampling.observe = [&](std::size_t i, const StatePoint& at) { forces.observe(i, at); };
//   simulate(...), forces.table();
#pragma once

#include <cstddef>
#include <memory>

#include "app/results/trajectory_csv.hpp"
#include "core/dynamics/motion_solver.hpp"

namespace mbsopt::inline app {

class JointForces {
 public:
  // instants counts those of the whole run; the table keeps one of several, and the last.
  JointForces(const Scene& scene, const Eigen::VectorXd& rho, std::size_t instants);
  ~JointForces();

  void observe(std::size_t i, const StatePoint& at);
  void clear() { table_.rows.clear(); }
  const Trajectory& table() const { return table_; }

 private:
  std::size_t instants_, stride_;
  int first_ = 0;        // sensor of the first joint
  Mechanism mechanism_;  // the scene with a sensor for each component of each joint's force
  std::unique_ptr<MotionSolver> motion_;
  Trajectory table_;
};

}  // namespace mbsopt::inline app
