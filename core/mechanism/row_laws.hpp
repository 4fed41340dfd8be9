// The laws of time on the rows of Phi at one time: Phi - f, Phidot - f_t, Phiddot - f_tt, and the derivatives of these
// terms. The order 0, 1 or 2 stands for f, f_t or f_tt. A mechanism without drives and rods has none and costs nothing.
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
  double f_or_zero(int row) const { return has_law(row) ? jets_[index_of(row)][0] : 0.0; }

  void subtract(std::size_t order, Eigen::VectorXd& out) const {
    for (std::size_t k = 0; k < jets_.size(); ++k) out(row_of_law_[k]) -= jets_[k][order];
  }

  // Adds scale times the gradient of -(mu0'f + mu1'f_t + mu2'f_tt). A null weight is zero.
  void add_pull_back(const Eigen::VectorXd* mu0, const Eigen::VectorXd* mu1, const Eigen::VectorXd* mu2, double scale,
                     Eigen::Ref<Eigen::VectorXd> theta_bar, Eigen::Ref<Eigen::VectorXd> rho_bar);
  // Adds weight times the gradient of one row's law in the active parameters. A row without a law has none.
  void add_gradient(std::size_t order, int row, double weight, Eigen::Ref<Eigen::VectorXd> rho_bar) const;
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
