// The second-order term of nonlinear least squares, learnt from gradients (the structured secant of NL2SOL):
//
//   (|z|^2/2)_xx = J'J + S,   S ~ sum_i z_i z_i,xx,      S s = y# = (J+ - J)' z+   along the step s,   y = J+'z+ - J'z
//
//   S <- tau S + (r y' + y r')/(y's) - (r's) y y'/(y's)^2,   r = y# - tau S s,   tau = min(1, |s'y#|/|s'S s|)
//
// Dennis, Gay and Welsch, "An adaptive nonlinear least-squares algorithm", ACM Transactions on Mathematical Software 7
// (1981) 348. The factor tau reduces S to the size that the last step shows, so S vanishes with the residuals. A step
// along which the gradient does not rise (y's <= 0) is left out.
//
//   ResidualCurvature S(n);
//   S.add(s, y, y_sharp);
//   const Eigen::MatrixXd H = J.transpose() * J + S.matrix();
#pragma once

#include <Eigen/Core>

namespace mbsopt::inline optim {

class ResidualCurvature {
 public:
  explicit ResidualCurvature(Eigen::Index variables) : S_(Eigen::MatrixXd::Zero(variables, variables)) {}

  void add(const Eigen::VectorXd& s, const Eigen::VectorXd& y, const Eigen::VectorXd& y_sharp);
  const Eigen::MatrixXd& matrix() const { return S_; }

 private:
  Eigen::MatrixXd S_;
};

}  // namespace mbsopt::inline optim
