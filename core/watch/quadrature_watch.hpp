// Integrals of running costs that the steps do not resolve. They are sums over nodes of steps whose size the motion
// alone determines.
//
// In each step g at the method's m nodes c_1..c_m has a highest divided difference, which vanishes for polynomials of
// degree below m - 1 (a null rule: Laurie, "Practical error estimation in numerical integration", J. Comput. Appl.
// Math. 12, 1985). Its scale makes it the difference of the b_i from a rule without one node: min_i |e_i / b_i| = 1.
// With S = h sum_i |b_i g_i| and its share r = min(1, h |sum_i e_i g_i| / S), the error is estimated as S r^(p/(m -
// 1)), p the order of the method: the error for a smooth g. A method of one node is compared with the node before, m =
// 2.
//
// Derivatives of psi are integrals of g_y y' + g_rho. They may be unresolved where g is not (sqrt(|x|) through zero).
// Only one of the two sweeps knows the directions y'. Instead, ydot and rho replace them: the errors of g_y ydot and
// g_rho rho are estimated like that of g. Both sweeps compute these gradients at each node.
//
// If the error of g is large, the watch searches for a pole. It halves the interval around the largest |g| along the
// step's Hermite cubic. If |g| times the interval's length does not fall, |g| grows at least like 1/|t - t*|, which has
// no integral.
//
//   QuadratureWatch watch(mechanism, method, costs, QuadratureWatch::Of::gradients, nullptr);
//   watch.take_gradient(objective, node, h * b, y_bar, ydot, rho_bar);  // after add_gradient(at, h * b, y_bar,
//   rho_bar) watch.end_step(step); ... watch.add_to(result.statistics);
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/run/simulation_result.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

// The distinct nodes of a quadrature: time, weight and weight in the null rule, of a step of length 1.
struct QuadratureNode {
  double c = 0, b = 0, e = 0;
};
// node_of: the place of each of n nodes in this list, -1 if it has no weight.
std::vector<QuadratureNode> quadrature_nodes(int n, const double* c, const double* b, std::vector<int>& node_of);

class QuadratureWatch {
 public:
  enum class Of { values, gradients };
  QuadratureWatch(const Mechanism& mechanism, const Method& method, std::span<const Cost> costs, Of what,
                  MotionSource* motion);

  // The integrand of a running cost at a node of the step (Method::nodes).
  void take_value(std::size_t cost, int node, double g) { at_node(0, cost, node) = g; }
  // y_bar, rho_bar: weight times its gradient; ydot: at the node.
  void take_gradient(std::size_t cost, int node, double weight, VecIn y_bar, VecIn ydot, VecIn rho_bar);
  // Call this after all nodes of a step, in any order of steps. Returns a reason to end the run, in words, or nothing.
  std::string end_step(const Step& step);
  void add_to(SimulationStatistics& statistics) const;

 private:
  struct Integral {
    double of_size = 0, error = 0;  // of |g|; of the estimates
    double worst = 0, worst_t = 0;  // the largest estimate, and when
    double last_g = 0;              // of the step before, for methods of one node
    int searches = 0;               // for poles
  };
  // Integrands of values: g. Integrands of gradients: g_y ydot and g_rho rho.
  std::size_t place(std::size_t integrand, std::size_t cost) const { return integrand * costs_.size() + cost; }
  double& at_node(std::size_t integrand, std::size_t cost, int node) {
    return g_[place(integrand, cost) * static_cast<std::size_t>(method_.nodes) + static_cast<std::size_t>(node)];
  }
  double add_error(const Step& step, std::size_t integrand, std::size_t cost);  // returns that of this step
  double pole(const Step& step, const PointCost& cost);

  const Mechanism mechanism_;
  const Method& method_;
  std::span<const Cost> costs_;
  const bool of_values_;
  MotionSource* motion_;
  std::vector<int> node_of_;
  const std::vector<QuadratureNode> nodes_;
  const double weights_;  // sum of |b|: 1, and 13 of dopri853, whose weights have both signs
  std::vector<Integral> integrals_;
  double start_ = 0, end_ = 0;    // of all steps [s], which go forward or backward
  std::vector<double> g_;         // at each node, of each integrand
  std::vector<double> distinct_;  // at the distinct nodes, of one integrand
  // The state may rest after a blow that its derivatives outlast: int |g_y|, per cost, counts by the fastest ydot.
  Eigen::MatrixXd influence_;
  Eigen::VectorXd fastest_;
  Eigen::VectorXd y_;
};

}  // namespace mbsopt
