// Coordinates of the states of a mechanism near one of them, y0, where they are those of the parameters u that set it:
//
//   s(y) = W (y' - y0),      W = (Y'Y)^-1 Y',   Y = dy0/du          so that s(y0(u + du)) = du to first order
//
// y' is y, with Euler parameters and their rates of each body by the sign that is nearer to y0: both are the same
// orientation.
#pragma once

#include <Eigen/Core>

namespace mbsopt::inline optim {

class StateChart {
 public:
  // y: (q, v), 14 numbers per body; y_u: its derivatives, of full column rank.
  StateChart(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_u);

  Eigen::Index size() const { return W_.rows(); }
  // y_rho: of these columns.
  void read(const Eigen::VectorXd& y, const Eigen::MatrixXd& y_rho, Eigen::VectorXd& s, Eigen::MatrixXd& s_rho) const;

 private:
  Eigen::VectorXd y0_;
  Eigen::MatrixXd W_;
};

}  // namespace mbsopt::inline optim
