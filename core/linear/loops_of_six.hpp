// The loops of kernel_table.hpp over blocks of six, for a type of register: Six, a column of a block. block_loops.hpp
// includes them.
#pragma once

#include "core/linear/kernel_table.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

template <class Six>
class LoopsOfSix {
 public:
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
      inverse[j] = d;
      inverse[j + 1] = e;
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
      sum3.add(alpha[r] * y[3], x);
      sum4.add(alpha[r] * y[4], x);
      sum5.add(alpha[r] * y[5], x);
    }
    sum3.store(to + 18);
    sum4.store(to + 24);
    sum5.store(to + 30);
  }
  static void add_weighted_squares(int count, const double* alpha, const RowsInSpace::Columns* nonzero, const double* a,
                                   const double* b, double* aa, double* bb, double* ab) {
    if (aa) add_square(count, alpha, nonzero, a, a, aa);
    if (bb) add_square(count, alpha, nonzero, b, b, bb);
    if (ab) add_square(count, alpha, nonzero, a, b, ab);
  }
};

}  // namespace
}  // namespace mbsopt
