#include "core/linear/elimination.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cassert>
#include <map>
#include <set>

#include "core/linear/fixed_size.hpp"

namespace mbsopt {
namespace {

std::vector<int> minimum_degree(int n, std::span<const std::pair<int, int>> edges) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i) entries.emplace_back(i, i, 1.0);
  for (const auto& [i, j] : edges) {
    entries.emplace_back(i, j, 1.0);
    entries.emplace_back(j, i, 1.0);
  }
  Eigen::SparseMatrix<double> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  const auto& order = permutation.indices();
  return {order.data(), order.data() + order.size()};
}

}  // namespace

Elimination::Elimination(int bodies, std::span<const std::pair<int, int>> edges)
    : position(at(bodies)), order(minimum_degree(bodies, edges)), columns(at(bodies)), updates(at(bodies)) {
  for (int k = 0; k < bodies; ++k) position[at(order[at(k)])] = k;

  // The rows of column k are its own edges and the fill of its children.
  std::vector<std::set<int>> rows(at(bodies));
  for (const auto& [a, b] : edges) {
    const int i = position[at(a)], j = position[at(b)];
    rows[at(std::min(i, j))].insert(std::max(i, j));
  }
  std::vector<std::map<int, std::size_t>> places(at(bodies));
  for (std::size_t k = 0; k < at(bodies); ++k) {
    for (const int i : rows[k]) {
      places[k][i] = blocks;
      columns[k].push_back({i, order[at(i)], blocks++});
    }
    if (rows[k].empty()) continue;
    const int parent = *rows[k].begin();
    for (const int i : rows[k]) {
      if (i != parent) rows[at(parent)].insert(i);
    }
  }
  for (std::size_t k = 0; k < at(bodies); ++k) {
    const std::vector<Entry>& column = columns[k];
    for (std::size_t i = 0; i < column.size(); ++i) {
      updates[k].push_back({at(column[i].row), i, i, true});
      for (std::size_t j = 0; j < i; ++j) {
        updates[k].push_back({places[at(column[j].row)].at(column[i].row), i, j, false});
      }
    }
  }
}

Elimination::Place Elimination::place(int row, int column) const {
  const int i = position[at(row)], j = position[at(column)];
  const std::vector<Entry>& entries = columns[at(std::min(i, j))];
  const auto found = std::lower_bound(entries.begin(), entries.end(), std::max(i, j),
                                      [](const Entry& e, int wanted) { return e.row < wanted; });
  assert(found != entries.end() && found->row == std::max(i, j));
  return {found->block, i < j};
}

}  // namespace mbsopt
