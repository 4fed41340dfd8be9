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
// g_rho rho are estimated like that of g (gradient_quadrature.hpp).
//
// If the error is large, the watch searches for a pole. It halves the interval around the largest |g| along the step's
// Hermite cubic. If |g| times the interval's length does not fall, |g| grows at least like 1/|t - t*|, which has no
// integral.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

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
  QuadratureWatch(const Method& method, std::span<const Cost> costs, MotionSource* motion);

  enum class Integrand { value, along_motion, along_parameters };  // g, g_y ydot, g_rho rho
  static constexpr std::size_t kIntegrals = 3;                     // of each cost

  // Call this after each step with the integrand of each running cost at each node (Method::nodes). Returns a reason to
  // end the run, in words, or an empty string.
  std::string look_at(const Step& step, std::size_t cost, std::span<const double> g, Integrand what = Integrand::value);

  // The integral counts as one of this size, if it is smaller.
  void count_at_least(std::size_t cost, Integrand what, double size);
  void add_to(SimulationStatistics& statistics) const;

 private:
  struct Integral {
    double of_size = 0, error = 0;  // of |g|; of the estimates
    double worst = 0, worst_t = 0;  // the largest estimate, and when
    double last_g = 0;              // of the step before, for methods of one node
    int searches = 0;               // for poles
  };
  double pole(const Step& step, const PointCost& cost);

  const Method& method_;
  std::span<const Cost> costs_;
  MotionSource* motion_;
  std::vector<int> node_of_;
  const std::vector<QuadratureNode> nodes_;
  std::vector<Integral> integrals_;
  double start_ = 0, end_ = 0;  // of all steps [s], which go forward or backward
  std::vector<double> g_;       // at the nodes
  Eigen::VectorXd y_;
};

}  // namespace mbsopt
