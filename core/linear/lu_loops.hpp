// The loops of lu_kernels.hpp for a type of register: ColumnOf<M> holds M numbers, M even. For the two files that
// compile them (block_kernels.cpp, block_kernels_avx2.cpp).
#pragma once

#include "core/linear/lu_kernels.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

template <template <int> class ColumnOf, int N>
class LuLoops {
 public:
  static constexpr LuKernels kernels() {
    return {.factor_diagonal = &factor_diagonal,
            .divide_by_upper = &divide_by_upper,
            .divide_by_lower_transposed = &divide_by_lower_transposed,
            .subtract_product = &subtract_product,
            .subtract_times = &subtract_times,
            .subtract_transposed_times = &subtract_transposed_times,
            .solve_lower = &solve_lower,
            .solve_upper = &solve_upper,
            .solve_upper_transposed = &solve_upper_transposed,
            .solve_lower_transposed = &solve_lower_transposed};
  }

 private:
  static constexpr int kStride = N + N % 2;
  using Column = ColumnOf<kStride>;
  // Two columns at a time read the others half as often, where the registers hold both.
  static constexpr int kAtOnce = Column::kRegisters <= 7 ? 2 : 1;

  static void swap(double& x, double& y) {
    const double z = x;
    x = y;
    y = z;
  }
  static double size(double x) { return x < 0 ? -x : x; }

  // factor(j, k), of X_k in the sum of X_j: X_j -= sum_{k < j} factor(j, k) X_k, then X_j *= scale(j), column by
  // column.
  template <class Factor, class Scale>
  static void eliminate(const Factor& factor, const Scale& scale, double* X) {
    int j = 0;
    if constexpr (kAtOnce == 2) {
      for (; j + 2 <= N; j += 2) {
        double *const to = X + j * kStride, *const next = to + kStride;
        Column x(to), y(next);
        for (int k = 0; k < j; ++k) {
          const double* const of_k = X + k * kStride;
          x.subtract(factor(j, k), of_k);
          y.subtract(factor(j + 1, k), of_k);
        }
        x.scale(scale(j));
        x.store(to);
        y.subtract(factor(j + 1, j), to);
        y.scale(scale(j + 1));
        y.store(next);
      }
    }
    for (; j < N; ++j) {
      Column x(X + j * kStride);
      for (int k = 0; k < j; ++k) x.subtract(factor(j, k), X + k * kStride);
      x.scale(scale(j));
      x.store(X + j * kStride);
    }
  }

  static bool factor_diagonal(double* D, int* exchanged, double* inverse) {
    for (int j = 0; j < N; ++j) {
      double* const column = D + j * kStride;
      int largest = j;
      for (int i = j + 1; i < N; ++i) {
        if (size(column[i]) > size(column[largest])) largest = i;
      }
      exchanged[j] = largest;
      if (largest != j) {
        for (int c = 0; c < N; ++c) swap(D[j + c * kStride], D[largest + c * kStride]);
      }
      inverse[j] = 1 / column[j];
      if (!(size(inverse[j]) <= 1.7976931348623157e308)) return false;  // infinite, or not a number
      double l[kStride] = {};
      for (int i = j + 1; i < N; ++i) l[i] = column[i] *= inverse[j];
      for (int c = j + 1; c < N; ++c) Column::subtract_from(j + 1, D[j + c * kStride], l, D + c * kStride);
    }
    return true;
  }

  static void divide_by_upper(const double* D, const double* inverse, double* X) {
    eliminate([D](int j, int k) { return D[k + j * kStride]; }, [inverse](int j) { return inverse[j]; }, X);
  }

  static void divide_by_lower_transposed(const double* D, const int* exchanged, double* X) {
    for (int j = 0; j < N; ++j) {
      if (exchanged[j] == j) continue;
      for (int i = 0; i < kStride; ++i) swap(X[i + j * kStride], X[i + exchanged[j] * kStride]);
    }
    eliminate([D](int j, int k) { return D[j + k * kStride]; }, [](int) { return 1.0; }, X);
  }

  static void subtract_product(const double* A, const double* B, double* C) {
    int c = 0;
    if constexpr (kAtOnce == 2) {
      for (; c + 2 <= N; c += 2) {
        Column x(C + c * kStride), y(C + (c + 1) * kStride);
        for (int k = 0; k < N; ++k) {
          const double* const of_k = A + k * kStride;
          x.subtract(B[c + k * kStride], of_k);
          y.subtract(B[c + 1 + k * kStride], of_k);
        }
        x.store(C + c * kStride);
        y.store(C + (c + 1) * kStride);
      }
    }
    for (; c < N; ++c) {
      Column x(C + c * kStride);
      for (int k = 0; k < N; ++k) x.subtract(B[c + k * kStride], A + k * kStride);
      x.store(C + c * kStride);
    }
  }

  static void subtract_times(const double* A, const double* x, double* y) {
    Column sum(y);
    for (int k = 0; k < N; ++k) sum.subtract(x[k], A + k * kStride);
    sum.store(y);
  }
  static void subtract_transposed_times(const double* A, const double* x, double* y) {
    const Column of_x(x);
    for (int k = 0; k < N; ++k) y[k] -= of_x.dot(A + k * kStride);
  }

  static void solve_lower(const double* D, const int* exchanged, double* y) {
    for (int j = 0; j < N; ++j) swap(y[j], y[exchanged[j]]);
    for (int j = 0; j < N; ++j) {
      for (int i = j + 1; i < N; ++i) y[i] -= D[i + j * kStride] * y[j];
    }
  }
  static void solve_upper(const double* D, const double* inverse, double* y) {
    for (int j = N - 1; j >= 0; --j) {
      y[j] *= inverse[j];
      for (int i = 0; i < j; ++i) y[i] -= D[i + j * kStride] * y[j];
    }
  }
  static void solve_upper_transposed(const double* D, const double* inverse, double* y) {
    for (int j = 0; j < N; ++j) {
      for (int i = 0; i < j; ++i) y[j] -= D[i + j * kStride] * y[i];
      y[j] *= inverse[j];
    }
  }
  static void solve_lower_transposed(const double* D, const int* exchanged, double* y) {
    for (int j = N - 1; j >= 0; --j) {
      for (int i = j + 1; i < N; ++i) y[j] -= D[i + j * kStride] * y[i];
    }
    for (int j = N - 1; j >= 0; --j) swap(y[j], y[exchanged[j]]);
  }
};

template <template <int> class ColumnOf>
constexpr LuKernelTable lu_kernel_table() {
  return {LuLoops<ColumnOf, 7>::kernels(), LuLoops<ColumnOf, 14>::kernels(), LuLoops<ColumnOf, 21>::kernels(),
          LuLoops<ColumnOf, 28>::kernels()};
}

}  // namespace
}  // namespace mbsopt
