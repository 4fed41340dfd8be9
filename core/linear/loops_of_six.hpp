// The loops of kernel_table.hpp over blocks of six and over single vectors in space, for a type of register: Six, a
// column of a block. block_loops.hpp includes them.
#pragma once

#include "core/linear/kernel_table.hpp"
#include "core/linear/prefetch.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

template <class Six>
class LoopsOfSix {
 public:
  static constexpr RowKernels<RowsInSpace> row_kernels() {
    return {.solve = &solve,
            .subtract_times = &subtract_times,
            .subtract_transposed_times =
                [](const RowsInSpace& J, const double* lambda, double* x) {
                  subtract_transposed(
                      J, [lambda](int row) { return lambda[row]; }, x);
                },
            .load = &load,
            .correct = &correct};
  }

  // Factors A = L D L' from the lower triangle of A. It writes W = inv(L) below the diagonal, zeros elsewhere, and the
  // inverse of D. Returns false if D is not positive. Two pivots at a time, a and c - b^2/a = (a c - b^2)/a, need two
  // quotients that the processor computes at once.
  static bool factor_diagonal(double* A, double* inverse) {
    double l[36];  // L below the diagonal, by columns
#pragma GCC unroll 3
    for (int j = 0; j < 6; j += 2) {
      const double a = A[7 * j], b = A[7 * j + 1], c = A[7 * j + 7], determinant = a * c - b * b;
      if (!(a > 0 && determinant > 0)) return false;
      const double d = 1 / a, e = a * (1 / determinant);
      inverse[j] = d, inverse[j + 1] = e;
      Six first(A + 6 * j), second(A + 6 * j + 6);
      second.subtract(b * d, A + 6 * j);
      second.store(A + 6 * j + 6);
#pragma GCC unroll 6
      for (int k = j + 2; k < 6; ++k) {
        Six of_k(A + 6 * k);
        of_k.subtract(A[k + 6 * j] * d, A + 6 * j);
        of_k.subtract(A[k + 6 * j + 6] * e, A + 6 * j + 6);
        of_k.store(A + 6 * k);
      }
      first.scale(d);
      first.store(l + 6 * j);
      second.scale(e);
      second.store(l + 6 * j + 6);
    }
    // W L = I:  W(:, j) = e_j - sum_{k > j} L(k, j) W(:, k), from the last column. The unit diagonal is set last.
#pragma GCC unroll 6
    for (int j = 5; j >= 0; --j) {
      Six w = Six::zero();
#pragma GCC unroll 6
      for (int k = 5; k > j; --k) w.subtract(l[k + 6 * j], A + 6 * k);
      w.store(A + 6 * j);
      A[7 * j] = 1;
    }
    for (int j = 0; j < 6; ++j) A[7 * j] = 0;
    return true;
  }

  // LD = A W',  A = LD inv(D), column by column from the last.
  static void divide(const double* W, const double* inverse, double* A, double* LD) {
#pragma GCC unroll 6
    for (int j = 5; j >= 0; --j) {
      Six sum(A + 6 * j);
#pragma GCC unroll 6
      for (int k = 0; k < j; ++k) sum.add(W[j + 6 * k], A + 6 * k);
      sum.store(LD + 6 * j);
      sum.scale(inverse[j]);
      sum.store(A + 6 * j);
    }
  }

  // C -= A B'
  static void subtract_product(const double* A, const double* B, double* C) {
#pragma GCC unroll 6
    for (int j = 0; j < 6; ++j) {
      Six sum(C + 6 * j);
#pragma GCC unroll 6
      for (int k = 0; k < 6; ++k) sum.subtract(B[j + 6 * k], A + 6 * k);
      sum.store(C + 6 * j);
    }
  }

  static void solve(const FactorView& f, double* x) {
    for (int k = 0; k < f.bodies; ++k) {
      prefetch<36>(f.W, 36 * (k + kAhead)), prefetch<36>(f.L, 36 * (f.first_block[k] + kAhead));
      double* y = x + 6 * f.order[k];
      const double* W = f.W + 36 * k;
      Six sum(y);
#pragma GCC unroll 6
      for (int j = 0; j < 5; ++j) sum.add(y[j], W + 6 * j);
      sum.store(y);
      for (int b = f.first_block[k]; b < f.first_block[k + 1]; ++b) {
        double* z = x + 6 * f.body[b];
        Six below(z);
#pragma GCC unroll 6
        for (int j = 0; j < 6; ++j) below.subtract(y[j], f.L + 36 * b + 6 * j);
        below.store(z);
      }
    }
    for (int k = f.bodies - 1; k >= 0; --k) {
      prefetch<36>(f.W, 36 * (k - kAhead)), prefetch<36>(f.L, 36 * (f.first_block[k] - kAhead));
      double* y = x + 6 * f.order[k];
      Six sum = Six(y) * Six(f.inverse_D + 6 * k);
      for (int b = f.first_block[k]; b < f.first_block[k + 1]; ++b)
        sum -= Six(x + 6 * f.body[b]).times_columns(f.L + 36 * b);
      sum += sum.times_columns(f.W + 36 * k);
      sum.store(y);
    }
  }

  // to(:, j) += sum_r alpha_r b_r(j) a_r, a_r and b_r rows of six
  static void add_square(int count, const double* alpha, const RowsInSpace::Columns* nonzero, const double* a,
                         const double* b, double* to) {
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      Six sum(to + 6 * j);
      for (int r = 0; r < count; ++r) {
        if (nonzero[r].first <= j && j < nonzero[r].last) sum.add(alpha[r] * b[6 * r + j], a + 6 * r);
      }
      sum.store(to + 6 * j);
    }
    Six sum3(to + 18), sum4(to + 24), sum5(to + 30);
    for (int r = 0; r < count; ++r) {
      const double* const x = a + 6 * r;
      const double* const y = b + 6 * r;
      sum3.add(alpha[r] * y[3], x), sum4.add(alpha[r] * y[4], x), sum5.add(alpha[r] * y[5], x);
    }
    sum3.store(to + 18), sum4.store(to + 24), sum5.store(to + 30);
  }
  static void add_weighted_squares(int count, const double* alpha, const RowsInSpace::Columns* nonzero, const double* a,
                                   const double* b, double* aa, double* bb, double* ab) {
    if (aa) add_square(count, alpha, nonzero, a, a, aa);
    if (bb) add_square(count, alpha, nonzero, b, b, bb);
    if (ab) add_square(count, alpha, nonzero, a, b, ab);
  }

  // Prefetches the rows of later groups: five rows each, as a hinge has.
  [[gnu::always_inline]] static void prefetch_rows(const RowsInSpace& J, const RowsInSpace::Group& g) {
    constexpr int kRows = 5;
    prefetch<6 * kRows>(J.J1, 6 * (g.block + kRows * kAhead)),
        prefetch<6 * kRows>(J.J2, 6 * (g.block + kRows * kAhead));
  }

  // x -= J'lambda. lambda(row) returns the row's multiplier.
  template <class Lambda>
  static void subtract_transposed(const RowsInSpace& J, const Lambda& lambda, double* x) {
    const auto subtract = [&](int body, const double* rows_of_body, const RowsInSpace::Group& g) {
      if (body == 0) return;
      double* const to = x + 6 * (body - 1);
      Six sum(to);
      for (int r = 0; r < g.rows; ++r) sum.subtract(lambda(g.row + r), rows_of_body + 6 * (g.block + r));
      sum.store(to);
    };
    for (std::size_t k = 0; k < J.group_count; ++k) {
      const RowsInSpace::Group& g = J.groups[k];
      prefetch_rows(J, g);
      subtract(g.body1, J.J1, g), subtract(g.body2, J.J2, g);
    }
  }

  static void load(const RowsInSpace& J, const SaddleIterate& at, bool first, double* correction) {
    for (std::size_t k = 0; k < J.body_count; ++k) {
      const RowsInSpace::Body& m = J.bodies[k];
      const double* const b = at.b + 6 * k;
      const double* const x = at.x + 6 * k;
      double* const y = correction + 6 * k;
      if (first) {
        for (int i = 0; i < 6; ++i) y[i] = b[i];
        continue;
      }
      for (int i = 0; i < 3; ++i) y[i] = b[i] - m.mass * x[i];
      for (int i = 0; i < 3; ++i) y[3 + i] = b[3 + i] - m.J[i] * x[3] - m.J[i + 3] * x[4] - m.J[i + 6] * x[5];
    }
    if (first) {
      subtract_transposed(
          J, [&](int row) { return -at.alpha[row] * at.residual[row]; }, correction);
    } else {
      subtract_transposed(
          J, [&](int row) { return at.nu[row] - at.alpha[row] * at.residual[row]; }, correction);
    }
  }

  static void subtract_times(const RowsInSpace& J, const double* x, double* y) {
    for (std::size_t k = 0; k < J.group_count; ++k) {
      const RowsInSpace::Group& g = J.groups[k];
      prefetch_rows(J, g);
      const bool both = g.body1 > 0 && g.body2 > 0;
      const int body = g.body1 > 0 ? g.body1 : g.body2;
      if (body == 0) continue;
      const double* const rows1 = (g.body1 > 0 ? J.J1 : J.J2) + 6 * g.block;
      const double* const rows2 = J.J2 + 6 * g.block;
      const Six x1(x + 6 * (body - 1)), x2(x + 6 * ((both ? g.body2 : body) - 1));
      double* const to = y + g.row;
      int r = 0;
      for (; r + 2 <= g.rows; r += 2) {
        auto sum = x1.times_two(rows1 + 6 * r);
        if (both) sum += x2.times_two(rows2 + 6 * r);
        to[r] -= sum[0], to[r + 1] -= sum[1];
      }
      if (r == g.rows) continue;
      double sum = x1.times(rows1 + 6 * r);
      if (both) sum += x2.times(rows2 + 6 * r);
      to[r] -= sum;
    }
  }

  static SaddleSizes correct(const RowsInSpace& J, const SaddleIterate& at, bool first, const double* correction) {
    const std::size_t unknowns = 6 * J.body_count;
    for (std::size_t i = 0; i < unknowns; ++i) at.x[i] = first ? correction[i] : at.x[i] + correction[i];
    subtract_times(J, correction, at.residual);
    for (std::size_t r = 0; r < at.rows; ++r) {
      const double step = at.alpha[r] * at.residual[r];
      at.nu[r] = first ? -step : at.nu[r] - step;
    }
    return {largest(at.x, unknowns), largest(at.residual, at.rows)};
  }
  static double largest(const double* x, std::size_t count) {
    Six sizes = Six::zero();
    std::size_t i = 0;
    for (; i + 6 <= count; i += 6) sizes.grow_to(Six(x + i));
    double size = sizes.largest();
    for (; i < count; ++i) {
      const double of_x = x[i] < 0 ? -x[i] : x[i];
      size = size > of_x ? size : of_x;
    }
    return size;
  }
};

}  // namespace
}  // namespace mbsopt
