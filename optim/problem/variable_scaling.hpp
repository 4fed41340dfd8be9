// The map between parameters rho (SI units) and the variables x of an optimiser, about 1 in size.
//
//   linear   rho = s x        s = |value|, but min((upper - lower)/100, felt) if 100 |value| is below both bounds'
//                             distance and felt; 1 where nothing tells
//   log      rho = exp(x)     for a parameter whose order of magnitude alone is known; rho > 0
//   log10    rho = 10^x
//
// felt is the change of rho that alters what the optimiser sees by its own size. Bounds may be so wide that they tell
// nothing. Scaled by them alone, x would be tiny, and so would be all steps and slopes.
//
//   const VariableScaling scaling({k1, L1});
//   Eigen::VectorXd x = scaling.to_x(rho);
//   Eigen::VectorXd f_x = f_rho.cwiseProduct(scaling.rho_x(x));   // the chain rule
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/scene/scene.hpp"

namespace mbsopt::inline optim {

inline constexpr double kWideRange = 100;  // times the size of a value: it tells nothing of a wider range

// Whether the bounds of a parameter, and not its value, set its scale if nothing else is known.
bool is_scaled_by_range(const Parameter& p);

class VariableScaling {
 public:
  // Takes the chosen parameters, in the order of x. Throws std::invalid_argument if a logarithm does not exist, if the
  // bounds are reversed, or if the value lies outside of them.
  // felt: per parameter; empty, or infinite, where it is not known.
  explicit VariableScaling(const std::vector<Parameter>& parameters, const Eigen::VectorXd& felt = {});

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
  Eigen::VectorXd each(double (Variable::*map)(double) const, const Eigen::VectorXd& of) const;

  std::vector<Variable> variables_;
  Eigen::VectorXd x_lower_, x_upper_, rho_lower_, rho_upper_;
};

}  // namespace mbsopt::inline optim
