// Between parameters rho (SI units) and the variables x an optimiser sees, about 1 in size.
//
//   linear   rho = s x        s = max(|value|, (upper - lower)/100), or 1 where that is 0
//   log      rho = exp(x)     for what is known only in its order of magnitude; rho > 0
//   log10    rho = 10^x
//
//   const VariableScaling scaling({k1, L1});
//   Eigen::VectorXd x = scaling.to_x(rho);
//   Eigen::VectorXd f_x = f_rho.cwiseProduct(scaling.rho_x(x));   // the chain rule
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt {

class VariableScaling {
 public:
  // The chosen parameters, in the order of x. Throws std::invalid_argument where a logarithm does not exist, where the
  // bounds are the wrong way round and where the value lies outside of them.
  explicit VariableScaling(const std::vector<Parameter>& parameters);

  Eigen::Index size() const { return static_cast<Eigen::Index>(variables_.size()); }
  Eigen::VectorXd to_x(const Eigen::VectorXd& rho) const;
  Eigen::VectorXd to_rho(const Eigen::VectorXd& x) const;      // within the bounds, whatever the rounding
  Eigen::VectorXd rho_x(const Eigen::VectorXd& x) const;       // d rho_k / d x_k
  Eigen::VectorXd rho_xx(const Eigen::VectorXd& x) const;      // d2 rho_k / d x_k^2
  const Eigen::VectorXd& x_lower() const { return x_lower_; }  // -infinity where there is none
  const Eigen::VectorXd& x_upper() const { return x_upper_; }

 private:
  struct Variable {
    ParameterScale scale = ParameterScale::linear;
    double s = 1;
    double to_x(double rho) const;
    double to_rho(double x) const;
    double rho_x(double x) const;
    double rho_xx(double x) const;
  };
  std::vector<Variable> variables_;
  Eigen::VectorXd x_lower_, x_upper_, rho_lower_, rho_upper_;
};

}  // namespace mbsopt
