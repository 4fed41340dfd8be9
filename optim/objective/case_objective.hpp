// The function of a design over its terms and load cases, from their values psi_c, term by term in each case. w_c: the
// weight of the term, times that of the case.
//
//   sum      f = sum of w_c psi_c
//   maximum  f = (1/k) log( sum of exp(k w_c psi_c) )      above the largest w_c psi_c by log(their number)/k at most,
//            or the largest itself, if the design gives no sharpness k
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
  // Returns the value of one load case, without its weight.
  double of_case(const Eigen::VectorXd& psi, Eigen::Index load_case) const;

 private:
  Eigen::VectorXd shares(const Eigen::VectorXd& weighted) const;

  Eigen::VectorXd a_, w_;       // weights of the terms; of all values
  double k_ = 0;                // 0: a sum; infinite: the true maximum
  bool takes_largest_ = false;  // of the terms
};

}  // namespace mbsopt::inline optim
