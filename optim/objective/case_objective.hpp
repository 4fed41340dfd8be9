// The function of a design over its load cases, from the values psi_c of its objective in them:
//
//   sum   f = sum of w_c psi_c
//   max   f = (1/k) log( sum of exp(k w_c psi_c) )      above the largest w_c psi_c by log(cases)/k at most,
//         or the largest itself, if the design gives no sharpness k
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

class CaseObjective {
 public:
  CaseObjective() : CaseObjective({}, {}) {}  // f = psi
  CaseObjective(const std::vector<CaseSpec>& cases, const DesignSpec& design);

  double value(const Eigen::VectorXd& psi) const;
  Eigen::VectorXd gradient(const Eigen::VectorXd& psi) const;  // f_psi
  Eigen::MatrixXd hessian(const Eigen::VectorXd& psi) const;   // f_psipsi
  double true_value(const Eigen::VectorXd& psi) const;         // the true maximum; else f
  bool is_maximum() const { return k_ > 0; }
  bool is_true_maximum() const { return std::isinf(k_); }
  const Eigen::VectorXd& weights() const { return w_; }

 private:
  Eigen::VectorXd shares(const Eigen::VectorXd& weighted) const;

  Eigen::VectorXd w_;
  double k_ = 0;  // 0: a sum; infinite: the true maximum
};

}  // namespace mbsopt::inline optim
