// The loops of kernel_table.hpp over lanes of tangents, for a type of register: Row, kLanes numbers; and with those of
// loops_of_six.hpp the table of all. For the two files that compile them.
#pragma once

#include "core/linear/kernel_table.hpp"
#include "core/linear/loops_of_six.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

template <class Row, class Six>
class BlockLoops {
 public:
  static constexpr BlockKernels kernels() {
    return {.factor_diagonal = &LoopsOfSix<Six>::factor_diagonal,
            .divide = &LoopsOfSix<Six>::divide,
            .subtract_product = &LoopsOfSix<Six>::subtract_product,
            .solve = &LoopsOfSix<Six>::solve_vector,
            .add_weighted_squares = &LoopsOfSix<Six>::add_weighted_squares,
            .load = &LoopsOfSix<Six>::load_vector,
            .correct = &LoopsOfSix<Six>::correct_vector,
            .solve_lanes_in_space = &solve<6>,
            .solve_lanes_in_plane = &solve<3>,
            .subtract_times_in_space = &subtract_times_in_space,
            .subtract_times_in_plane = &subtract_times_in_plane,
            .subtract_transposed_times_in_space = &subtract_transposed_times_in_space,
            .subtract_transposed_times_in_plane = &subtract_transposed_times_in_plane,
            .load_lanes_in_space = &load_in_space,
            .load_lanes_in_plane = &load_in_plane,
            .correct_lanes_in_space = &correct_in_space,
            .correct_lanes_in_plane = &correct_in_plane,
            .add_motion_of_bodies = &add_motion_of_bodies,
            .add_motion_of_rows = &add_motion_of_rows,
            .sum_stages = &sum_stages};
  }

 private:
  static Row* rows(double* x) { return reinterpret_cast<Row*>(x); }
  static const Row* rows(const double* x) { return reinterpret_cast<const Row*>(x); }

  // x = W x and x = W'x, W unit lower; y -= L x and y -= L'x. By columns.
  template <int N>
  static void multiply(const double* W, Row* x) {
#pragma GCC unroll 6
    for (int i = N - 1; i > 0; --i) {
      Row sum = x[i];
#pragma GCC unroll 6
      for (int j = 0; j < i; ++j) sum += W[i + N * j] * x[j];
      x[i] = sum;
    }
  }
  template <int N>
  static void multiply_transposed(const double* W, Row* x) {
#pragma GCC unroll 6
    for (int j = 0; j < N - 1; ++j) {
      Row sum = x[j];
#pragma GCC unroll 6
      for (int i = j + 1; i < N; ++i) sum += W[i + N * j] * x[i];
      x[j] = sum;
    }
  }
  template <int N>
  static void subtract_times(const double* L, const Row* x, Row* y) {
#pragma GCC unroll 6
    for (int i = 0; i < N; ++i) {
      Row sum = y[i];
#pragma GCC unroll 6
      for (int j = 0; j < N; ++j) sum -= L[i + N * j] * x[j];
      y[i] = sum;
    }
  }
  template <int N>
  static void subtract_transposed_times(const double* L, const Row* x, Row* y) {
#pragma GCC unroll 6
    for (int j = 0; j < N; ++j) {
      Row sum = y[j];
#pragma GCC unroll 6
      for (int i = 0; i < N; ++i) sum -= L[i + N * j] * x[i];
      y[j] = sum;
    }
  }

  template <int N>
  static void solve(const FactorView& f, double* numbers) {
    Row* const x = rows(numbers);
    for (int k = 0; k < f.bodies; ++k) {
      Row* y = x + N * f.order[k];
      multiply<N>(f.W + N * N * k, y);
      for (int b = f.first_block[k]; b < f.first_block[k + 1]; ++b)
        subtract_times<N>(f.L + N * N * b, y, x + N * f.body[b]);
    }
    for (int k = f.bodies - 1; k >= 0; --k) {
      Row* y = x + N * f.order[k];
      for (int i = 0; i < N; ++i) y[i] *= f.inverse_D[N * k + i];
      for (int b = f.first_block[k]; b < f.first_block[k + 1]; ++b)
        subtract_transposed_times<N>(f.L + N * N * b, x + N * f.body[b], y);
      multiply_transposed<N>(f.W + N * N * k, y);
    }
  }

  static void subtract_times(const RowsInSpace& J, const RowsInSpace::Group& g, const double* a, const Row* from,
                             Row* to) {
    const Row x3 = from[3], x4 = from[4], x5 = from[5];
    const RowsInSpace::Columns* nonzero = J.columns + g.block;
    for (int r = 0; r < g.rows; ++r, a += 6, ++nonzero) {
      Row sum = to[r];
      if (nonzero->last - nonzero->first == 1) {
        sum -= a[nonzero->first] * from[nonzero->first];
      } else if (nonzero->last != nonzero->first) {
        sum -= a[0] * from[0], sum -= a[1] * from[1], sum -= a[2] * from[2];
      }
      sum -= a[3] * x3, sum -= a[4] * x4, sum -= a[5] * x5;
      to[r] = sum;
    }
  }
  static void subtract_times(const RowsInSpace& J, const Row* x, Row* y) {
    for (std::size_t k = 0; k < J.group_count; ++k) {
      const RowsInSpace::Group& g = J.groups[k];
      if (g.body1 > 0) subtract_times(J, g, J.J1 + 6 * g.block, x + 6 * (g.body1 - 1), y + g.row);
      if (g.body2 > 0) subtract_times(J, g, J.J2 + 6 * g.block, x + 6 * (g.body2 - 1), y + g.row);
    }
  }
  static void subtract_times_in_space(const RowsInSpace& J, const double* x, double* y) {
    subtract_times(J, rows(x), rows(y));
  }

  // Lambda: row -> Row.
  template <class Lambda>
  static void subtract_transposed_times(const RowsInSpace& J, const RowsInSpace::Group& g, const double* a,
                                        const Lambda& lambda, Row* to) {
    Row x3 = to[3], x4 = to[4], x5 = to[5];
    const RowsInSpace::Columns* nonzero = J.columns + g.block;
    for (int r = 0; r < g.rows; ++r, a += 6, ++nonzero) {
      const Row l = lambda(g.row + r);
      if (nonzero->last - nonzero->first == 1) {
        to[nonzero->first] -= a[nonzero->first] * l;
      } else if (nonzero->last != nonzero->first) {
        to[0] -= a[0] * l, to[1] -= a[1] * l, to[2] -= a[2] * l;
      }
      x3 -= a[3] * l, x4 -= a[4] * l, x5 -= a[5] * l;
    }
    to[3] = x3, to[4] = x4, to[5] = x5;
  }
  template <class Lambda>
  static void subtract_transposed(const RowsInSpace& J, const Lambda& lambda, Row* x) {
    for (std::size_t k = 0; k < J.group_count; ++k) {
      const RowsInSpace::Group& g = J.groups[k];
      if (g.body1 > 0) subtract_transposed_times(J, g, J.J1 + 6 * g.block, lambda, x + 6 * (g.body1 - 1));
      if (g.body2 > 0) subtract_transposed_times(J, g, J.J2 + 6 * g.block, lambda, x + 6 * (g.body2 - 1));
    }
  }
  static void subtract_transposed_times_in_space(const RowsInSpace& J, const double* lambda, double* x) {
    subtract_transposed(
        J, [l = rows(lambda)](int r) { return l[r]; }, rows(x));
  }

  static void subtract_times(const RowsInPlane& J, const Row* x, Row* y) {
    for (std::size_t k = 0; k < J.point_count; ++k) {
      const RowsInPlane::Point& p = J.points[k];
      Row first = y[p.row], second = y[p.row2];
      if (p.body2 > 0) {
        const Row* b = x + 3 * (p.body2 - 1);
        first -= b[0] - p.x2[1] * b[2], second -= b[1] + p.x2[0] * b[2];
      }
      if (p.body1 > 0) {
        const Row* b = x + 3 * (p.body1 - 1);
        first += b[0] - p.x1[1] * b[2], second += b[1] + p.x1[0] * b[2];
      }
      y[p.row] = first, y[p.row2] = second;
    }
    for (std::size_t k = 0; k < J.entry_count; ++k) {
      const RowsInPlane::Entry& e = J.entries[k];
      const Row* b = x + 3 * (e.body - 1);
      y[e.row] -= e.J[0] * b[0] + e.J[1] * b[1] + e.J[2] * b[2];
    }
  }
  static void subtract_times_in_plane(const RowsInPlane& J, const double* x, double* y) {
    subtract_times(J, rows(x), rows(y));
  }
  template <class Lambda>
  static void subtract_transposed(const RowsInPlane& J, const Lambda& lambda, Row* x) {
    for (std::size_t k = 0; k < J.point_count; ++k) {
      const RowsInPlane::Point& p = J.points[k];
      const Row first = lambda(p.row), second = lambda(p.row2);
      if (p.body2 > 0) {
        Row* b = x + 3 * (p.body2 - 1);
        b[0] -= first, b[1] -= second, b[2] -= p.x2[0] * second - p.x2[1] * first;
      }
      if (p.body1 > 0) {
        Row* b = x + 3 * (p.body1 - 1);
        b[0] += first, b[1] += second, b[2] += p.x1[0] * second - p.x1[1] * first;
      }
    }
    for (std::size_t k = 0; k < J.entry_count; ++k) {
      const RowsInPlane::Entry& e = J.entries[k];
      const Row l = lambda(e.row);
      Row* b = x + 3 * (e.body - 1);
      for (int i = 0; i < 3; ++i) b[i] -= e.J[i] * l;
    }
  }
  static void subtract_transposed_times_in_plane(const RowsInPlane& J, const double* lambda, double* x) {
    subtract_transposed(
        J, [l = rows(lambda)](int r) { return l[r]; }, rows(x));
  }

  // y = b - M x
  static void subtract_mass_times(const RowsInSpace::Body& m, const Row* b, const Row* x, Row* y) {
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) y[i] = b[i] - m.mass * x[i];
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) y[3 + i] = b[3 + i] - m.J[i] * x[3] - m.J[i + 3] * x[4] - m.J[i + 6] * x[5];
  }
  static void subtract_mass_times(const RowsInPlane::Body& m, const Row* b, const Row* x, Row* y) {
    y[0] = b[0] - m.mass * x[0], y[1] = b[1] - m.mass * x[1], y[2] = b[2] - m.inertia * x[2];
  }

  template <int N, class Jacobian>
  static void load(const Jacobian& J, const SaddleIterate& at, bool first, double* numbers) {
    const Row* const b = rows(at.b);
    const Row* const x = rows(static_cast<const double*>(at.x));
    Row* const y = rows(numbers);
    const Row* const nu = rows(static_cast<const double*>(at.nu));
    const Row* const residual = rows(static_cast<const double*>(at.residual));
    const double* const alpha = at.alpha;
    if (first) {
      for (std::size_t i = 0; i < N * J.body_count; ++i) y[i] = b[i];
      subtract_transposed(
          J, [=](int r) { return -alpha[r] * residual[r]; }, y);
    } else {
      for (std::size_t k = 0; k < J.body_count; ++k) subtract_mass_times(J.bodies[k], b + N * k, x + N * k, y + N * k);
      subtract_transposed(
          J, [=](int r) { return nu[r] - alpha[r] * residual[r]; }, y);
    }
  }
  static void load_in_space(const RowsInSpace& J, const SaddleIterate& at, bool first, double* correction) {
    load<6>(J, at, first, correction);
  }
  static void load_in_plane(const RowsInPlane& J, const SaddleIterate& at, bool first, double* correction) {
    load<3>(J, at, first, correction);
  }

  template <int N, class Jacobian>
  static SaddleSizes correct(const Jacobian& J, const SaddleIterate& at, bool first, const double* correction) {
    Row* const x = rows(at.x);
    Row* const nu = rows(at.nu);
    Row* const residual = rows(at.residual);
    const Row* const dx = rows(correction);
    Row largest_x = Row::zero(), largest_residual = Row::zero();
    for (std::size_t i = 0; i < N * J.body_count; ++i) {
      const Row sum = first ? dx[i] : x[i] + dx[i];
      x[i] = sum;
      largest_x.grow_to(sum);
    }
    subtract_times(J, dx, residual);
    for (std::size_t r = 0; r < at.rows; ++r) {
      const Row s = residual[r];
      nu[r] = first ? -at.alpha[r] * s : nu[r] - at.alpha[r] * s;
      largest_residual.grow_to(s);
    }
    return {largest_x.largest(), largest_residual.largest()};
  }
  static SaddleSizes correct_in_space(const RowsInSpace& J, const SaddleIterate& at, bool first, const double* dx) {
    return correct<6>(J, at, first, dx);
  }
  static SaddleSizes correct_in_plane(const RowsInPlane& J, const SaddleIterate& at, bool first, const double* dx) {
    return correct<3>(J, at, first, dx);
  }

  // sum += B x of the columns first to last of B
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
  // Rows of the same bodies, those of a joint, read the directions once.
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

  // Four rows of both sums at a time stay in registers.
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
        sum_q[i] += c[j] * x, sum_v[i] += d[j] * x;
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
