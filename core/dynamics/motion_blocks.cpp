#include "core/dynamics/motion_blocks.hpp"

#include "core/mechanism/coupling.hpp"

namespace mbsopt {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

void list(const std::vector<std::vector<int>>& bodies, std::vector<MotionBlocks::Place>& places,
          std::vector<int>& begin) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    begin.push_back(static_cast<int>(places.size()));
    for (const int body : bodies[i]) places.push_back({static_cast<int>(i), body - 1});
  }
  begin.push_back(static_cast<int>(places.size()));
}

// y += X x, one row of x after the other: the compiler unrolls these.
template <int Rows, int Columns, class X>
void add_product(const Mat<Rows, 7>& B, int first, const X& x, Eigen::Index row, Lanes<Rows>& y) {
  for (int j = 0; j < Columns; ++j) {
    const Lanes<1> xj = x.row(row + first + j);
    for (int i = 0; i < Rows; ++i) y.row(i) += B(i, first + j) * xj;
  }
}

template <int Rows>
void add_block(const MotionBlocks::Block<Rows>& B, const LaneRows& y, Eigen::Index q, Eigen::Index v,
               Lanes<Rows>& out) {
  if (B.parts & MotionBlocks::p) add_product<Rows, 4>(B.q, 3, y, q, out);
  if (B.parts & MotionBlocks::pdot) add_product<Rows, 4>(B.v, 3, y, v, out);
  if (B.parts & MotionBlocks::r) add_product<Rows, 3>(B.q, 0, y, q, out);
  if (B.parts & MotionBlocks::rdot) add_product<Rows, 3>(B.v, 0, y, v, out);
}

}  // namespace

MotionBlocks::MotionBlocks(const MechanismData& data) : n_(data.n) {
  const Coupling coupled = coupling(data);
  list(coupled.bodies, pairs_, pair_begin_);
  list(coupled.rows, rows_, row_begin_);
  b.resize(pairs_.size());
  c.resize(rows_.size());
}

int MotionBlocks::find(const std::vector<Place>& places, const std::vector<int>& begin, int row, int body) {
  int low = begin[at(row)], high = begin[at(row) + 1] - 1;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (places[at(middle)].body < body) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

void MotionBlocks::set_zero() {
  for (Block<6>& x : b) x.q.setZero(), x.v.setZero();
  for (Block<1>& x : c) x.q.setZero(), x.v.setZero();
}

void MotionBlocks::add_times(const LaneRows& y_dir, std::vector<Lanes<6>>& b_dir, LaneRows& c_dir) const {
  for (int i = 0; i < n_; ++i) {
    Lanes<6> sum = b_dir[at(i)];
    for (int k = pair_begin_[at(i)]; k < pair_begin_[at(i) + 1]; ++k) {
      const Eigen::Index q = 7 * pairs_[at(k)].body;
      add_block(b[at(k)], y_dir, q, 7 * n_ + q, sum);
    }
    b_dir[at(i)] = sum;
  }
  for (std::size_t row = 0; row + 1 < row_begin_.size(); ++row) {
    Lanes<1> sum = c_dir.row(static_cast<Eigen::Index>(row));
    for (int k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
      const Eigen::Index q = 7 * rows_[at(k)].body;
      add_block(c[at(k)], y_dir, q, 7 * n_ + q, sum);
    }
    c_dir.row(static_cast<Eigen::Index>(row)) = sum;
  }
}

}  // namespace mbsopt
