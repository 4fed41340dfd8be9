// The innermost loops of BlockLu. As those of kernel_table.hpp they are compiled twice, for any processor and for
// AVX2, and take plain arrays.
#pragma once

namespace mbsopt {

// Over blocks of N x N numbers by columns, N of them and a zero where N is odd. D = P'L U: a diagonal block once it is
// factored; exchanged: per row, with which; inverse: of U's diagonal.
struct LuKernels {
  bool (*factor_diagonal)(double* D, int* exchanged, double* inverse);         // false: a pivot is zero or not a number
  void (*divide_by_upper)(const double* D, const double* inverse, double* X);  // X inv(U)
  void (*divide_by_lower_transposed)(const double* D, const int* exchanged, double* X);  // X P'inv(L')
  void (*subtract_product)(const double* A, const double* B, double* C);                 // C -= A B'
  void (*subtract_times)(const double* A, const double* x, double* y);                   // y -= A x
  void (*subtract_transposed_times)(const double* A, const double* x, double* y);        // y -= A'x
  void (*solve_lower)(const double* D, const int* exchanged, double* y);                 // y = inv(L) P y
  void (*solve_upper)(const double* D, const double* inverse, double* y);                // y = inv(U) y
  void (*solve_upper_transposed)(const double* D, const double* inverse, double* y);     // y = inv(U') y
  void (*solve_lower_transposed)(const double* D, const int* exchanged, double* y);      // y = P'inv(L') y
};

// Blocks of 7, 14, 21 and 28 rows.
struct LuKernelTable {
  LuKernels of_7, of_14, of_21, of_28;

  const LuKernels& of(long rows) const { return rows == 7 ? of_7 : rows == 14 ? of_14 : rows == 21 ? of_21 : of_28; }
};

const LuKernelTable& lu_kernels();  // for this processor

// Each by itself, for tests. AVX2: null where the program or the processor lacks it.
const LuKernelTable& portable_lu_kernels();
const LuKernelTable* avx2_lu_kernels();

}  // namespace mbsopt
