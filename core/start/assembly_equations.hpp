// The equations of initial assembly, at position and at velocity level, with first and second derivatives.
//
//   position:  F(q, rho)    = [ Phi of all joints;     p'p - 1 per body;    sensor - value per condition ]
//   velocity:  F(q, v, rho) = [ Phi_q v of all joints; 2 p'pdot per body;   sensor's rate - rate per condition ]
//
// Every rate except the norm of a velocity is linear in v, so second derivatives need no code of their own. With v =
// e_j, the gradient of the rate  nu'F_q e_j  in q is the j-th column of (F_q'nu)_q. Its gradient in rho is the j-th row
// of (F_q'nu)_rho. These are exact, without differences.
#pragma once

#include <vector>

#include "core/linear/sparse_projection.hpp"
#include "core/mechanism/row_laws.hpp"

namespace mbsopt {

enum class AssemblyLevel { position, velocity };

// A sensor and the value that it must have.
struct AssemblyTarget {
  int condition = 0;  // index in MechanismData::conditions
  SensorPtr sensor;
  SensorPtr rate;  // its time derivative; at velocity level the sensor itself
  double value = 0;
  int slot = -1;
  double branch = 0;  // of an angle: the last accepted value, from which it continues
};

class AssemblyEquations {
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

  Eigen::Index rows() const;  // joints first, then unit norms, then targets
  const std::vector<AssemblyTarget>& targets() const { return targets_; }

  // y = (q, v); the position level ignores v.
  Eigen::VectorXd values(const Eigen::VectorXd& y) const;
  struct Gradients {
    Eigen::MatrixXd y, rho;  // rows x 14n, rows x P (all parameters)
  };
  Gradients gradients(const Eigen::VectorXd& y) const;
  Eigen::MatrixXd gradients_in_y(const Eigen::VectorXd& y) const;
  // The same, with the gradient in the state as entries. Entries at the same place add up.
  struct SparseGradients {
    std::vector<SparseEntry> y;
    Eigen::MatrixXd rho;
  };
  SparseGradients sparse_gradients(const Eigen::VectorXd& y) const;
  // The derivative of F_x'nu, with x = q at position level and x = v at velocity level.   7n x 14n, 7n x P
  Gradients second(const Eigen::VectorXd& y, const Eigen::VectorXd& nu) const;

  // If not all equations can be satisfied, bodies stay rigid: unit norms weigh a thousand times a metre or radian.
  Eigen::VectorXd weights() const;

  void continue_branches(const Eigen::VectorXd& y);

  using Row = Eigen::Ref<Eigen::RowVectorXd, 0, Eigen::InnerStride<>>;  // a row of a matrix

 private:
  Eigen::VectorXd branches(const AssemblyTarget& target) const;
  void add_target_curvature(const AssemblyTarget& target, const Eigen::VectorXd& y, double nu, Gradients& out) const;
  template <class AddEntry, class AddField>
  void collect_joints(AssemblyLevel level, const Eigen::VectorXd& y, int only, AddEntry&& add,
                      AddField&& add_field) const;
  template <class AddEntry>
  void collect_gradients(const Eigen::VectorXd& y, AddEntry&& add, Eigen::MatrixXd* rho) const;
  void add_law_gradients(Eigen::MatrixXd& rho) const;
  double term_value(const Constraint& c, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) const;
  void add_slot(int slot, const Eigen::Ref<const Eigen::VectorXd>& bar, Row rho_bar) const;

  const MechanismData& data_;
  AssemblyLevel level_;
  double t_;
  std::vector<AssemblyTarget> targets_;
  Eigen::VectorXd angles_;
  RowLaws laws_;  // at t
};

}  // namespace mbsopt
