// A user's expression over t, sensors and parameters ("(tip_y - 0.5)^2") as a cost of one instant, with exact
// gradients:
//
//   g(t, y, rho) = e(rho, t, s(y, rho))       g_y = sum_k e_sk s_k,y        g_rho = e_rho + sum_k e_sk s_k,rho
//
// It is compiled once per scene, and bound to a mechanism (one value of rho) as often as needed:
//
//   const CostExpression compiled(Expression::parse("(tip_y - y0)^2"), scene);
//   std::shared_ptr<const PointCost> cost = compiled.bind(mechanism);
//   double g = cost->value({t, y, angles});
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/scene/scene.hpp"

namespace mbsopt::inline optim {

// The names in an objective: parameters (inputs 0..P-1), "t" (input P), sensors (from P+1), definitions, signals.
Symbols cost_symbols(const Scene& scene);
// The same without t, signals and sensors, for expressions of parameters alone.
Symbols parameter_symbols(const Scene& scene);
// Parameters, then t, with definitions and signals.
Symbols time_symbols(const Scene& scene);

// The numbers of a vector, as programs take them.
auto numbers_of(auto& x) { return std::span(x.data(), static_cast<std::size_t>(x.size())); }

// A scalar e of u = (parameters, sensors) along the tangents U = du/drho of a motion.
struct SecondOrder {
  double value = 0;
  Eigen::VectorXd first;   // U' e_u, its derivative
  Eigen::MatrixXd second;  // U' e_uu U, its second derivative but for that of u
};

class CostExpression {
 public:
  CostExpression(const Expression& expression, const Scene& scene);  // throws UnknownName
  bool is_zero() const { return is_zero_; }                          // the constant 0: costs nothing
  const void* id() const { return compiled_.get(); }                 // the same of copies
  // Returns whether it is linear in parameters and sensors at any fixed time: its second derivatives are 0.
  bool is_linear() const;
  std::shared_ptr<const PointCost> bind(const Mechanism& mechanism) const;
  // y_rho is dy/drho in all parameters. variables selects those of rho for the result.
  SecondOrder second_order(const Mechanism& mechanism, const StatePoint& at, const Eigen::MatrixXd& y_rho,
                           const std::vector<int>& variables) const;

 private:
  struct Compiled;
  std::shared_ptr<const Compiled> compiled_;
  bool is_zero_ = false;
};

}  // namespace mbsopt::inline optim
