// Curvature learnt from gradients: BFGS (Nocedal and Wright, "Numerical Optimization", 2nd ed., equation 6.19) over the
// last iterates. It is always positive definite, so it replaces a Hessian that is not.
//
//   s = x_k - x_k-1,  y = f_x,k - f_x,k-1:     B <- B - (B s)(B s)'/(s' B s) + y y'/(y' s),   left out where y's <= 0
//
//   SecantCurvature curvature(1);           // of the first matrix, a multiple of the identity
//   curvature.add(x, f_x);                  // each iterate
//   curvature.matrix();
//
// It also corrects incomplete Hessians G (Gauss-Newton). If G contradicts the last step, |y - G s| > min(|y|, |G s|)/2,
// BFGS starts from G. Al-Baali and Fletcher (J. Oper. Res. Soc. 36 (1985) 405) also choose between the two by such a
// test.
//
//   if (curvature.contradicts(G)) G = curvature.matrix_from(G);
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>

namespace mbsopt::inline optim {

class SecantCurvature {
 public:
  explicit SecantCurvature(double first, std::size_t pairs = 20) : first_(first), pairs_(pairs) {}

  // The last iterate, added again, changes nothing.
  void add(const Eigen::VectorXd& x, const Eigen::VectorXd& f_x);
  Eigen::MatrixXd matrix() const;                                   // there must have been an iterate
  Eigen::MatrixXd matrix_from(const Eigen::MatrixXd& first) const;  // positive semidefinite
  bool contradicts(const Eigen::MatrixXd& H) const;                 // false before the second iterate

 private:
  struct Iterate {
    Eigen::VectorXd x, f_x;
  };
  struct Pair {
    Eigen::VectorXd s, y;
  };
  Pair pair(std::size_t k) const;  // between iterates k - 1 and k

  double first_;
  std::size_t pairs_;
  std::deque<Iterate> iterates_;  // oldest first
};

}  // namespace mbsopt::inline optim
