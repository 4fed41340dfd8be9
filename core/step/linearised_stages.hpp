// Linearises the coupled stages of an accepted implicit step, each with its own Jacobian. The tangent and the adjoint
// sweep solve with them.
#pragma once

#include <vector>

#include "core/step/stage_matrix.hpp"
#include "core/step/step.hpp"
#include "core/tableau/method.hpp"

namespace mbsopt {

class LinearisedStages {
 public:
  LinearisedStages(const LinearisedStages&) = delete;  // its matrices refer to its Jacobian
  LinearisedStages& operator=(const LinearisedStages&) = delete;
  LinearisedStages(const MechanismData& data, const Method& method, SpatialDynamics& dynamics);

  // Places the equations at a stage; linearise() also evaluates its Jacobian, as that of stage k of a group (from 0).
  StageEquations& place_at(const Step& step, int stage);
  StageEquations& linearise(const Step& step, int stage, int k);
  bool factor(double h, const StageGroup& group);
  // In place; x: (7 n + m) rows per stage; columns: kLanes, and any number of the transposed.
  void solve(const StageGroup& group, Eigen::MatrixXd& x);
  void solve_transposed(const StageGroup& group, Eigen::MatrixXd& x);
  long factorisations() const;
  long places() const { return equations_.places(); }

 private:
  std::size_t of(const StageGroup& group) const;  // which matrix; how many there are if it has none

  const Method& rk_;
  StageEquations equations_;
  Eigen::VectorXd y_;
  MotionJacobian jacobian_;
  std::vector<MotionJacobian::Values> values_;  // per stage of the group in hand
  std::vector<StageMatrix> matrices_;           // per size of a group
  std::vector<Eigen::MatrixXd> A_;              // the same: of the group in hand
};

}  // namespace mbsopt
