// The laws of time on the rows of Phi at one time: Phi - f, Phidot - f_t, Phiddot - f_tt, and the derivatives of these
// terms. A mechanism without drives and rods has none and costs nothing.
#pragma once

#include <initializer_list>
#include <vector>

#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class RowLaws {
 public:
  explicit RowLaws(const MechanismData& data);
  // The rows are those listed; each is named by its place in the list.
  RowLaws(const MechanismData& data, const std::vector<int>& rows);

  void set_time(double t);
  void hold() { held_ = true; }  // from now on f_t = f_tt = 0
  double f_or_zero(int row) const { return has_law(row) ? jets_[index_of(row)].f : 0.0; }

  void subtract_f(Eigen::VectorXd& phi) const;
  void subtract_f_t(Eigen::VectorXd& phi_dot) const;
  void subtract_f_tt(Eigen::VectorXd& phi_ddot) const;

  // Adds scale times the gradient of -(mu0'f + mu1'f_t + mu2'f_tt). A null weight is zero.
  void add_pull_back(const Eigen::VectorXd* mu0, const Eigen::VectorXd* mu1, const Eigen::VectorXd* mu2, double scale,
                     Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar);
  // Adds weight times the gradient of f, or of f_t, of one row in the active parameters. A row without a law has none.
  enum class Derivative { f, f_t };
  void add_gradient(Derivative what, int row, double weight, Eigen::Ref<Eigen::VectorXd> rho_bar) const;
  // Subtracts the tangents of f, f_t and f_tt, up to the number of outputs.
  void subtract_tangents(const ParameterBlock& block, std::initializer_list<LaneRows*> out);

 private:
  bool has_law(int row) const { return !jets_.empty() && law_of_row_[static_cast<std::size_t>(row)] >= 0; }
  std::size_t index_of(int row) const { return static_cast<std::size_t>(law_of_row_[static_cast<std::size_t>(row)]); }

  const MechanismData* data_;
  std::vector<int> row_of_law_, law_of_row_;
  std::vector<TimeLaw::Jet> jets_;
  std::vector<double> inputs_, gradient_;
  Program::Scratch scratch_;
  bool held_ = false;
};

}  // namespace mbsopt
