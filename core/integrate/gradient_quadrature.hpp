// Integrals in the derivatives of running costs that the steps do not resolve (quadrature_watch.hpp). Both sweeps
// compute the gradients of the running costs at each node; what they compute is watched here.
//
//   GradientQuadrature watch(mechanism, method, costs);
//   watch.take(objective, node, h * b, y_bar, ydot, rho_bar);   // after cost.add_gradient(at, h * b, y_bar, rho_bar)
//   watch.end_step(step); ... watch.add_to(result.statistics);
#pragma once

#include <span>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"
#include "core/watch/quadrature_watch.hpp"

namespace mbsopt {

class GradientQuadrature {
 public:
  GradientQuadrature(const Mechanism& mechanism, const Method& method, std::span<const Cost> costs);

  // y_bar, rho_bar: weight times the gradient; ydot: at the node (Method::nodes).
  void take(std::size_t cost, int node, double weight, VecIn y_bar, VecIn ydot, VecIn rho_bar);
  void end_step(const Step& step);  // after all of its nodes, in any order of steps
  void add_to(SimulationStatistics& statistics);

 private:
  const Mechanism mechanism_;
  std::span<const Cost> costs_;
  std::size_t nodes_;
  QuadratureWatch watch_;
  std::vector<double> along_motion_, along_parameters_;  // g_y ydot, g_rho rho at each node of each cost
  // The state may rest after a blow that its derivatives outlast: int |g_y|, per cost, counts by the fastest ydot.
  Eigen::MatrixXd influence_;
  Eigen::VectorXd fastest_;
};

}  // namespace mbsopt
