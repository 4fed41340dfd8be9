#include "optim/objective/one_to_one.hpp"

#include <limits>

namespace mbsopt::inline optim {

using Eigen::Index;

// The prices u, v of rows and columns keep  -gain(i, j) - u_i - v_j >= 0,  and 0 where row i has column j. Each row
// gets a column along the shortest path of exchanges, which begins at column 0: one beside the given ones, for the row
// that has none yet.
std::vector<Index> one_to_one(const Eigen::MatrixXd& gain) {
  constexpr Index kNone = -1;
  std::vector<Index> columns(static_cast<std::size_t>(gain.rows()), kNone);
  if (gain.cols() < gain.rows()) {
    const std::vector<Index> rows = one_to_one(gain.transpose());
    for (std::size_t j = 0; j < rows.size(); ++j) columns[static_cast<std::size_t>(rows[j])] = static_cast<Index>(j);
    return columns;
  }
  const Index n = gain.cols();
  Eigen::VectorXd u = Eigen::VectorXd::Zero(gain.rows()), v = Eigen::VectorXd::Zero(n + 1);
  Eigen::Vector<Index, Eigen::Dynamic> row_of = Eigen::Vector<Index, Eigen::Dynamic>::Constant(n + 1, kNone),
                                       before(n + 1);
  for (Index row = 0; row < gain.rows(); ++row) {
    Eigen::VectorXd length = Eigen::VectorXd::Constant(n + 1, std::numeric_limits<double>::infinity());
    std::vector<bool> is_done(static_cast<std::size_t>(n) + 1, false);
    Index column = 0;
    for (row_of(0) = row; row_of(column) != kNone;) {
      is_done[static_cast<std::size_t>(column)] = true;
      const Index from = row_of(column);
      Index nearest = kNone;
      for (Index j = 1; j <= n; ++j) {
        if (is_done[static_cast<std::size_t>(j)]) continue;
        if (const double here = -gain(from, j - 1) - u(from) - v(j); here < length(j)) {
          length(j) = here;
          before(j) = column;
        }
        if (nearest == kNone || length(j) < length(nearest)) nearest = j;
      }
      const double shortest = length(nearest);
      for (Index j = 0; j <= n; ++j) {
        if (!is_done[static_cast<std::size_t>(j)]) {
          length(j) -= shortest;
        } else {
          u(row_of(j)) += shortest;
          v(j) -= shortest;
        }
      }
      column = nearest;
    }
    for (; column != 0; column = before(column)) row_of(column) = row_of(before(column));
  }
  for (Index j = 1; j <= n; ++j)
    if (row_of(j) != kNone) columns[static_cast<std::size_t>(row_of(j))] = j - 1;
  return columns;
}

}  // namespace mbsopt::inline optim
