#include "core/linear/row_dependence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear/elimination.hpp"
#include "core/linear/fixed_size.hpp"

namespace mbsopt {
namespace {

constexpr int kMostDense = 60;  // bodies: within a second

using Eigen::Index;
using Eigen::MatrixXd;
using OfBody = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, 7>;  // no body has more columns
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The part of a row in the columns of one body, which its elimination position names.
struct Part {
  int position = 0;
  OfBody x;
};
struct Row {
  int number = 0;
  std::vector<Part> parts;  // by ascending position
};

std::vector<Row> rows_of(int rows, int width, std::span<const SparseEntry> J) {
  std::vector<Row> all(at(rows));
  for (const SparseEntry& e : J) {
    std::vector<Part>& parts = all[at(e.row)].parts;
    const int body = e.column / width;
    auto part = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.position == body; });
    if (part == parts.end()) part = parts.insert(part, {body, OfBody::Zero(width)});
    part->x(e.column % width) += e.value;
  }
  for (int i = 0; i < rows; ++i) {
    Row& row = all[at(i)];
    row.number = i;
    double squares = 0;
    for (const Part& part : row.parts) squares += part.x.squaredNorm();
    if (squares > 0)
      for (Part& part : row.parts) part.x /= std::sqrt(squares);
  }
  return all;
}

std::vector<std::pair<int, int>> pairs_of_bodies(const std::vector<Row>& rows) {
  std::vector<std::pair<int, int>> pairs;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.parts.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) pairs.emplace_back(row.parts[j].position, row.parts[i].position);
  }
  return pairs;
}

// Rows of a front in their order, restricted to the columns of its bodies.
class Front {
 public:
  Front(std::size_t rows, Index columns, double threshold)
      : X_(RowMajor::Zero(static_cast<Index>(rows), columns)), threshold_(threshold) {}

  RowMajor& rows() { return X_; }

  // Finds rows whose part in the columns [first, first + count) is independent of others, and clears it in the rest.
  // They are those that are independent of earlier ones, but small parts come after large ones.
  std::vector<bool> pivots(Index first, Index count) {
    std::vector<bool> is_pivot(static_cast<std::size_t>(X_.rows()), false);
    found_.resize(0);
    for (const double least : {std::max(kLarge, threshold_), threshold_}) {
      for (Index i = 0; i < X_.rows(); ++i) {
        if (is_pivot[static_cast<std::size_t>(i)]) continue;
        const double size = std::max(1.0, X_.row(i).norm());
        for (int twice = 0; twice < 2; ++twice) {
          for (const Index k : found_) {
            const double along = X_.row(i).segment(first, count).dot(X_.row(k).segment(first, count));
            X_.row(i) -= along * X_.row(k);
          }
        }
        const double left = X_.row(i).segment(first, count).norm();
        if (!(left > least * size) || static_cast<Index>(found_.size()) == count) continue;
        magnifies_ = magnifies_ || left < kLarge * size;
        X_.row(i) /= left;
        found_.push_back(i);
        is_pivot[static_cast<std::size_t>(i)] = true;
      }
    }
    return is_pivot;
  }

  // Returns whether a pivot row has so small a part that it magnifies the rounding of the rest beyond the threshold.
  bool magnifies() const { return magnifies_; }

  // Returns a column for each direction that the pivots' parts do not span: the column with the largest component.
  std::vector<int> unreached(Index first, Index count) const {
    MatrixXd left = MatrixXd::Identity(count, count);
    for (const Index k : found_) {
      left -= X_.row(k).segment(first, count).transpose() * X_.row(k).segment(first, count);
    }
    std::vector<int> columns;
    for (Index k = static_cast<Index>(found_.size()); k < count; ++k) {
      Index most = 0;
      left.diagonal().maxCoeff(&most);
      columns.push_back(static_cast<int>(most));
      const Eigen::VectorXd x = left.col(most) / std::sqrt(left(most, most));
      left -= x * x.transpose();
    }
    return columns;
  }

 private:
  static constexpr double kLarge = 1e-4;  // rounding over it, body after body, is below the thresholds of ranks, 1e-8

  RowMajor X_;
  double threshold_;
  bool magnifies_ = false;
  std::vector<Index> found_;
};

// Rows of body k, with its columns first, then those of the bodies that are eliminated later.
Front front_of(const std::vector<Row>& rows, int k, const std::vector<Elimination::Entry>& later, int width,
               double threshold) {
  Front front(rows.size(), width * (1 + static_cast<Index>(later.size())), threshold);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (const Part& part : rows[i].parts) {
      const auto other = std::ranges::lower_bound(later, part.position, {}, &Elimination::Entry::row);
      const Index column = part.position == k ? 0 : width * (1 + (other - later.begin()));
      front.rows().row(static_cast<Index>(i)).segment(column, width) = part.x;
    }
  }
  return front;
}

// All bodies at once, without a part to divide by.
RowDependence dense_row_dependence(int bodies, int width, const std::vector<Row>& rows, double threshold) {
  const Index columns = static_cast<Index>(width) * bodies;
  Front front(rows.size(), columns, threshold);
  for (const Row& row : rows)
    for (const Part& part : row.parts) front.rows().row(row.number).segment(width * part.position, width) = part.x;
  RowDependence result;
  result.independent = front.pivots(0, columns);
  result.rank = static_cast<int>(std::ranges::count(result.independent, true));
  for (const int column : front.unreached(0, columns)) result.unreached.push_back({column / width, column % width});
  return result;
}

}  // namespace

RowDependence row_dependence(int rows, int bodies, int width, std::span<const SparseEntry> J, double threshold) {
  RowDependence result;
  result.independent.assign(at(rows), false);
  std::vector<Row> all = rows_of(rows, width, J);
  const Elimination order(bodies, pairs_of_bodies(all));
  std::vector<std::vector<Row>> waiting(at(bodies));  // for the first body of theirs that is eliminated
  for (Row& row : all) {
    for (Part& part : row.parts) part.position = order.position[at(part.position)];
    std::sort(row.parts.begin(), row.parts.end(), [](const Part& a, const Part& b) { return a.position < b.position; });
    if (!row.parts.empty()) waiting[at(row.parts.front().position)].push_back(std::move(row));
  }
  for (int k = 0; k < bodies; ++k) {
    std::vector<Row> here = std::move(waiting[at(k)]);
    waiting[at(k)] = {};
    std::sort(here.begin(), here.end(), [](const Row& a, const Row& b) { return a.number < b.number; });
    const std::vector<Elimination::Entry>& others = order.columns[at(k)];
    const Index passed_on = width * static_cast<Index>(others.size());
    Front front = front_of(here, k, others, width, threshold);
    const std::vector<bool> is_pivot = front.pivots(0, width);
    for (const int column : front.unreached(0, width)) result.unreached.push_back({order.order[at(k)], column});
    std::vector<Index> rest;
    for (std::size_t i = 0; i < here.size(); ++i) {
      result.independent[at(here[i].number)] = is_pivot[i];
      if (!is_pivot[i] && passed_on > 0) rest.push_back(static_cast<Index>(i));
    }
    Front next(rest.size(), passed_on, threshold);
    for (std::size_t i = 0; i < rest.size(); ++i)
      next.rows().row(static_cast<Index>(i)) = front.rows().row(rest[i]).tail(passed_on);
    const std::vector<bool> goes_on = next.pivots(0, passed_on);
    if ((front.magnifies() || next.magnifies()) && bodies <= kMostDense)
      return dense_row_dependence(bodies, width, rows_of(rows, width, J), threshold);
    for (std::size_t i = 0; i < rest.size(); ++i) {
      if (!goes_on[i]) continue;
      Row row{here[static_cast<std::size_t>(rest[i])].number, {}};
      for (std::size_t j = 0; j < others.size(); ++j) {
        row.parts.push_back(
            {others[j].row, front.rows().row(rest[i]).segment(width * (1 + static_cast<Index>(j)), width)});
      }
      waiting[at(others.front().row)].push_back(std::move(row));
    }
  }
  result.rank = static_cast<int>(std::ranges::count(result.independent, true));
  return result;
}

}  // namespace mbsopt
