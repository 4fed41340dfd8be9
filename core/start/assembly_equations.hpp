// The equations of initial assembly, at position and at velocity level, with first and second derivatives.
//
//   position:  F(q, rho)    = [ Phi of all joints;     p'p - 1 per body;    sensor - value per condition ]
//   velocity:  F(q, v, rho) = [ Phi_q v of all joints; 2 p'pdot per body;   sensor's rate - rate per condition ]
//
// Every rate except the norm of a velocity is linear in v, so second derivatives need no code of their own. With v =
// e_j, the gradient of the rate  nu'F_q e_j  in q is the j-th column of (F_q'nu)_q. Its gradient in rho is the j-th row
// of (F_q'nu)_rho. These are exact, without differences.
#pragma once

#include <string>
#include <vector>

#include "core/linear/sparse_projection.hpp"
#include "core/mechanism/row_laws.hpp"
#include "core/start/nearest_point.hpp"
#include "core/start/poses.hpp"

namespace mbsopt {

enum class AssemblyLevel { position, velocity };

// A condition at the level of the equations.
struct AssemblyTarget {
  const ConditionData* condition;
  double branch;  // of an angle: the last accepted value, from which it continues

  const SensorPtr& sensor() const { return condition->measured; }
};

// As a problem of the nearest point, the unknowns x are q, or v at a held q.
class AssemblyEquations final : public NearestPointEquations {
 public:
  AssemblyEquations(const MechanismData& data, AssemblyLevel level, double t);

  // Sets the branches of followed joint angles within half a turn of zero at the guess. The last angle in a row of
  // several (a gear) is on the branch that satisfies the row best. From there on they are continued.
  void start_branches(const Eigen::VectorXd& y);
  const Eigen::VectorXd& angles() const { return angles_; }
  // The angles for a condition on an expression of several angles. An angle with a condition of its own is on its turn.
  Eigen::VectorXd followed_angles() const;
  void set_angles(const Eigen::VectorXd& angles) { angles_ = angles; }
  void settle_shared_rows(const Eigen::VectorXd& y, Eigen::VectorXd& angles) const;

  AssemblyLevel level() const { return level_; }
  Eigen::Index rows() const;  // joints first, then unit norms, then targets
  const std::vector<AssemblyTarget>& targets() const { return targets_; }

  // y = (q, v); the position level ignores v.
  Eigen::VectorXd values_at(const Eigen::VectorXd& y) const;
  // The gradient in the state as entries, of which those at the same place add up, and that in the parameters unless
  // rho is null: rows x 14n, rows x P (all parameters).
  std::vector<SparseEntry> entries(const Eigen::VectorXd& y, Eigen::MatrixXd* rho = nullptr) const;
  struct Gradients {
    Eigen::MatrixXd y, rho;
  };
  Gradients gradients(const Eigen::VectorXd& y) const;
  // The derivative of F_x'nu, with x = q at position level and x = v at velocity level.   7n x 14n, 7n x P
  Gradients second(const Eigen::VectorXd& y, const Eigen::VectorXd& nu) const;

  void hold(const Eigen::VectorXd& q) { q_ = q; }  // for the unknowns v

  Eigen::VectorXd values(const Eigen::VectorXd& x) const override { return values_at(state(x)); }
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& x) const override;
  Eigen::MatrixXd curvature(const Eigen::VectorXd& x, const Eigen::VectorXd& nu) const override {
    return second(state(x), nu).y.middleCols(first(x), x.size());
  }
  double step_fraction(const Eigen::VectorXd& step) const override;
  Eigen::VectorXd retracted(const Eigen::VectorXd& x) const override;
  // A length for r and 1 for p. The length is the root mean square of entries in p over those in r, in rows of J with
  // both.
  Eigen::VectorXd sizes(const Eigen::MatrixXd& J) const override;
  // |J| x, where the largest entry of r and of p (or of their rates) replaces each entry of theirs.
  Eigen::VectorXd magnitudes(const Eigen::VectorXd& x) const override;
  // If not all equations can be satisfied, bodies stay rigid: unit norms weigh a thousand times a metre or radian.
  Eigen::VectorXd weights() const override;
  void accept(const Eigen::VectorXd& x) override;  // continues the branches of angles

 private:
  template <class AddEntry, class AddField>
  void for_joint_gradients(AssemblyLevel level, const std::vector<Frame>& frames, int only, AddEntry&& add,
                           AddField&& add_field) const;
  bool positions() const { return level_ == AssemblyLevel::position; }
  Eigen::Index first(const Eigen::VectorXd& x) const { return positions() ? 0 : x.size(); }  // of the unknowns, in y
  Eigen::VectorXd state(const Eigen::VectorXd& x) const;
  // Calls f(row, column, value) for the entries of the Jacobian at x.
  template <class F>
  void for_jacobian(const Eigen::VectorXd& x, F&& f) const;
  Eigen::VectorXd branches(const AssemblyTarget& target) const;
  void add_target_curvature(const AssemblyTarget& target, const Eigen::VectorXd& y, double nu, Gradients& out) const;

  const MechanismData& data_;
  AssemblyLevel level_;
  double t_;
  std::vector<AssemblyTarget> targets_;
  Eigen::VectorXd angles_, q_;
  RowLaws laws_;  // at t
};

// The message of a failed assembly: the joints and conditions that stay violated, by how much, and what to try.
std::string assembly_failure(const MechanismData& data, const AssemblyEquations& equations, const NearestPoint& found);

}  // namespace mbsopt
