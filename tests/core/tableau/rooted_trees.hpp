// Rooted trees and elementary weights, for the order conditions of Runge-Kutta methods.
//   Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I" (1993), section II.2:
//   a method has order p where sum_i b_i Phi_i(t) = 1/gamma(t) for every rooted tree t of up to p nodes,
//   gamma(t) = |t| prod gamma(children),   Phi_i(t) = prod over children u of sum_j A_ij Phi_j(u).
// In a Rosenbrock method A_ij + gamma_ij takes the place of A_ij where a node has one child: "Solving Ordinary
// Differential Equations II" (1996), section IV.7.
#pragma once

#include <vector>

#include "core/tableau/tableaus.hpp"

namespace mbsopt::testing {

struct RootedTree {
  int order = 1;
  double gamma = 1;
  std::vector<std::size_t> children;  // indices into the list of trees, not rising
};

// All trees up to that order, by rising order.
inline std::vector<RootedTree> rooted_trees(int up_to) {
  std::vector<RootedTree> trees{{}};
  // Appends to `root` every multiset of earlier trees, `left` nodes in all, none after `last`.
  const auto grow = [&](const auto& self, RootedTree root, int left, std::size_t last) -> void {
    if (left == 0) {
      root.gamma = root.order;
      for (const std::size_t child : root.children) root.gamma *= trees[child].gamma;
      trees.push_back(root);
      return;
    }
    for (std::size_t child = 0; child <= last; ++child) {
      const int order = trees[child].order;
      if (order > left) break;
      RootedTree more = root;
      more.children.push_back(child);
      self(self, more, left - order, child);
    }
  };
  for (int order = 2; order <= up_to; ++order) {
    const std::size_t smaller = trees.size();
    RootedTree root;
    root.order = order;
    grow(grow, root, order - 1, smaller - 1);
  }
  return trees;
}

// Phi_i(t) of every stage, dense ones too, for each tree.
inline std::vector<std::vector<double>> elementary_weights(const Method& rk, const std::vector<RootedTree>& trees) {
  std::vector<std::vector<double>> weights;
  for (const RootedTree& tree : trees) {
    std::vector<double> Phi(static_cast<std::size_t>(rk.dense_stages), 1.0);
    for (const std::size_t child : tree.children) {
      for (int i = 0; i < rk.dense_stages; ++i) {
        double sum = 0;
        for (int j = 0; j < rk.dense_stages; ++j)
          sum += (tree.children.size() == 1 ? rk.beta(i, j) : rk.a(i, j)) * weights[child][static_cast<std::size_t>(j)];
        Phi[static_cast<std::size_t>(i)] *= sum;
      }
    }
    weights.push_back(Phi);
  }
  return weights;
}

// sum_i x_i Phi_i(t) - right
template <class Weight>  // Weight(i): x_i
double order_condition(int stages, const Weight& x, const std::vector<double>& Phi, double right) {
  double residual = -right;
  for (int i = 0; i < stages; ++i) residual += x(i) * Phi[static_cast<std::size_t>(i)];
  return residual;
}

}  // namespace mbsopt::testing
