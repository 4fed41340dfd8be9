#include "optim/objective/one_to_one.hpp"

#include <algorithm>
#include <limits>

namespace mbsopt::inline optim {

using Eigen::Index;

namespace {

constexpr Index kNone = -1;

// Adds one row after the other. row_prices and column_prices u, v keep  -gain(i, j) - u_i - v_j >= 0,  and 0 where row
// i has column j.
class Assignment {
 public:
  explicit Assignment(const Eigen::MatrixXd& gain)
      : gain_(gain),
        rows_(Eigen::VectorXd::Zero(gain.rows())),
        columns_(Eigen::VectorXd::Zero(gain.cols())),
        row_of_(static_cast<std::size_t>(gain.cols()), kNone) {}

  // Gives this row a column along the shortest path of exchanges.
  void add(Index row) {
    const Index n = gain_.cols();
    Eigen::VectorXd length = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::infinity());
    std::vector<Index> before(static_cast<std::size_t>(n), kNone);  // the column from whose row one comes
    std::vector<bool> is_done(static_cast<std::size_t>(n), false);
    Index column = kNone, from = row;
    double travelled = 0;
    while (from != kNone) {
      Index nearest = kNone;
      for (Index j = 0; j < n; ++j) {
        if (is_done[static_cast<std::size_t>(j)]) continue;
        const double here = travelled - gain_(from, j) - rows_(from) - columns_(j);
        if (here < length(j)) {
          length(j) = here;
          before[static_cast<std::size_t>(j)] = column;
        }
        if (nearest == kNone || length(j) < length(nearest)) nearest = j;
      }
      column = nearest;
      travelled = length(column);
      is_done[static_cast<std::size_t>(column)] = true;
      from = row_of_[static_cast<std::size_t>(column)];
    }
    rows_(row) += travelled;
    for (Index j = 0; j < n; ++j) {
      if (!is_done[static_cast<std::size_t>(j)] || j == column) continue;
      rows_(row_of_[static_cast<std::size_t>(j)]) += travelled - length(j);
      columns_(j) -= travelled - length(j);
    }
    while (column != kNone) {
      const Index previous = before[static_cast<std::size_t>(column)];
      row_of_[static_cast<std::size_t>(column)] = previous == kNone ? row : row_of_[static_cast<std::size_t>(previous)];
      column = previous;
    }
  }

  const std::vector<Index>& row_of() const { return row_of_; }

 private:
  const Eigen::MatrixXd& gain_;
  Eigen::VectorXd rows_, columns_;
  std::vector<Index> row_of_;  // column by column
};

}  // namespace

std::vector<Index> one_to_one(const Eigen::MatrixXd& gain) {
  if (gain.cols() < gain.rows()) {
    std::vector<Index> columns(static_cast<std::size_t>(gain.rows()), kNone);
    const std::vector<Index> rows = one_to_one(gain.transpose());
    for (std::size_t j = 0; j < rows.size(); ++j) columns[static_cast<std::size_t>(rows[j])] = static_cast<Index>(j);
    return columns;
  }
  Assignment assignment(gain);
  for (Index i = 0; i < gain.rows(); ++i) assignment.add(i);
  std::vector<Index> columns(static_cast<std::size_t>(gain.rows()), kNone);
  for (std::size_t j = 0; j < assignment.row_of().size(); ++j)
    if (const Index i = assignment.row_of()[j]; i != kNone)
      columns[static_cast<std::size_t>(i)] = static_cast<Index>(j);
  return columns;
}

}  // namespace mbsopt::inline optim
