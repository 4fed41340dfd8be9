// The table of kernel_table.hpp, from the loops over rows (row_loops.hpp), over blocks of six (loops_of_six.hpp) and
// over blocks of motion. It takes two types of registers: Row, kLanes numbers, and ColumnOf<M>, M numbers of a block's
// column. Only the two files that compile the table include this header.
#pragma once

#include "core/linear/kernel_table.hpp"
#include "core/linear/loops_of_six.hpp"
#include "core/linear/row_loops.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

template <class Row, template <int> class ColumnOf>
class BlockLoops {
  using OfSix = LoopsOfSix<ColumnOf<6>>;

 public:
  static constexpr BlockKernels kernels() {
    return {.factor_diagonal = &OfSix::factor_diagonal,
            .divide = &OfSix::divide,
            .subtract_product = &OfSix::subtract_product,
            .add_weighted_squares = &OfSix::add_weighted_squares,
            .in_space = RowLoops<One>::template kernels<RowsInSpace>(),
            .in_plane = RowLoops<One>::template kernels<RowsInPlane>(),
            .lanes_in_space = RowLoops<Row>::template kernels<RowsInSpace>(),
            .lanes_in_plane = RowLoops<Row>::template kernels<RowsInPlane>(),
            .add_motion_of_bodies = &add_motion_of_bodies,
            .add_motion_of_rows = &add_motion_of_rows,
            .sum_stages = &sum_stages};
  }

 private:
  static Row* rows(double* x) { return reinterpret_cast<Row*>(x); }
  static const Row* rows(const double* x) { return reinterpret_cast<const Row*>(x); }

  // sum += B x for the columns first to last of B
  static void add_columns(const double* B, int first, int last, const Row* x, Row* sum) {
    for (int j = first; j < last; ++j) {
      const Row xj = x[j];
#pragma GCC unroll 6
      for (int i = 0; i < 6; ++i) sum[i] += B[i + 6 * j] * xj;
    }
  }
  enum { r = 1, p = 2, rdot = 4, pdot = 8 };  // MotionBlocks::Part, whose header has inline functions
  static void add_motion_of_bodies(const MotionBlockView<6>* blocks, const MotionPlace* places, const int* first_place,
                                   std::size_t count, std::size_t n, const double* y, double* to) {
    const Row* const q = rows(y);
    const Row* const v = q + 7 * n;
    for (std::size_t row = 0; row < count; ++row) {
      Row* const out = rows(to) + 6 * row;
      Row sum[6];
#pragma GCC unroll 6
      for (int i = 0; i < 6; ++i) sum[i] = out[i];
      for (int k = first_place[row]; k < first_place[row + 1]; ++k) {
        const MotionBlockView<6>& b = blocks[k];
        const int body = 7 * places[k].body;
        if (b.parts & (r | p)) add_columns(b.q, b.parts & r ? 0 : 3, b.parts & p ? 7 : 3, q + body, sum);
        if (b.parts & (rdot | pdot)) add_columns(b.v, b.parts & rdot ? 0 : 3, b.parts & pdot ? 7 : 3, v + body, sum);
      }
#pragma GCC unroll 6
      for (int i = 0; i < 6; ++i) out[i] = sum[i];
    }
  }

  static bool same_places(const MotionBlockView<1>* blocks, const MotionPlace* places, int a, int b, int count) {
    for (int k = 0; k < count; ++k) {
      if (places[a + k].body != places[b + k].body || blocks[a + k].parts != blocks[b + k].parts) return false;
    }
    return true;
  }
  // Rows of one joint tie the same bodies, so they read the directions once.
  template <int Rows>
  static void add_rows_of_joint(const MotionBlockView<1>* blocks, const MotionPlace* places, int count, const Row* q,
                                const Row* v, Row* to) {
    Row sum[Rows];
#pragma GCC unroll 6
    for (int i = 0; i < Rows; ++i) sum[i] = to[i];
    for (int k = 0; k < count; ++k) {
      const int body = 7 * places[k].body, parts = blocks[k].parts;
      for (int j = parts & r ? 0 : 3; j < (parts & p ? 7 : 3); ++j) {
        const Row x = q[body + j];
#pragma GCC unroll 6
        for (int i = 0; i < Rows; ++i) sum[i] += blocks[k + i * count].q[j] * x;
      }
      for (int j = parts & rdot ? 0 : 3; j < (parts & pdot ? 7 : 3); ++j) {
        const Row x = v[body + j];
#pragma GCC unroll 6
        for (int i = 0; i < Rows; ++i) sum[i] += blocks[k + i * count].v[j] * x;
      }
    }
#pragma GCC unroll 6
    for (int i = 0; i < Rows; ++i) to[i] = sum[i];
  }
  static void add_motion_of_rows(const MotionBlockView<1>* blocks, const MotionPlace* places, const int* first_place,
                                 std::size_t count, std::size_t n, const double* y, double* to) {
    const Row* const q = rows(y);
    const Row* const v = q + 7 * n;
    for (std::size_t row = 0; row < count;) {
      const int first = first_place[row], bodies = first_place[row + 1] - first;
      std::size_t joint = 1;  // rows of it
      while (joint < 5 && row + joint < count && first_place[row + joint + 1] - first_place[row + joint] == bodies &&
             same_places(blocks, places, first, first_place[row + joint], bodies))
        ++joint;
      const auto add = joint == 5   ? &add_rows_of_joint<5>
                       : joint == 4 ? &add_rows_of_joint<4>
                       : joint == 3 ? &add_rows_of_joint<3>
                       : joint == 2 ? &add_rows_of_joint<2>
                                    : &add_rows_of_joint<1>;
      add(blocks + first, places + first, bodies, q, v, rows(to) + row);
      row += joint;
    }
  }

  // Four rows of both sums stay in registers at a time.
  static void sum_stages(std::size_t count, int terms, const double* const* k, const double* c, const double* d,
                         const double* q0, const double* v0, double* q, double* v) {
    constexpr int kRows = 4;
    std::size_t r = 0;
    for (; r + kRows <= count; r += kRows) sum_rows<kRows>(r, terms, k, c, d, q0, v0, q, v);
    for (; r < count; ++r) sum_rows<1>(r, terms, k, c, d, q0, v0, q, v);
  }
  template <int Rows>
  static void sum_rows(std::size_t first, int terms, const double* const* k, const double* c, const double* d,
                       const double* q0, const double* v0, double* q, double* v) {
    const Row* const from_q = rows(q0) + first;
    const Row* const from_v = rows(v0) + first;
    Row sum_q[Rows], sum_v[Rows];
#pragma GCC unroll 4
    for (int i = 0; i < Rows; ++i) sum_q[i] = from_q[i], sum_v[i] = from_v[i];
    for (int j = 0; j < terms; ++j) {
      const Row* const kj = rows(k[j]) + first;
#pragma GCC unroll 4
      for (int i = 0; i < Rows; ++i) {
        const Row x = kj[i];
        sum_q[i] += c[j] * x;
        sum_v[i] += d[j] * x;
      }
    }
    Row* const to_q = rows(q) + first;
    Row* const to_v = rows(v) + first;
#pragma GCC unroll 4
    for (int i = 0; i < Rows; ++i) to_q[i] = sum_q[i], to_v[i] = sum_v[i];
  }
};

}  // namespace
}  // namespace mbsopt
