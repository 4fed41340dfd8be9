// The innermost loops of the block solvers, for a single vector and for lanes (core/linear/fixed_size.hpp: four tangent
// directions at a time). They are compiled twice: for any processor, and for x86-64 processors with AVX2 and FMA, whose
// registers hold four numbers. The program selects by the processor, so the last bits of results depend on its kind.
//
// The loops take plain arrays and call no inline function of Eigen or the standard library. Compiled for AVX2, such a
// function would be the same symbol as elsewhere, and a linker may keep either.
#pragma once

#include <cstddef>

namespace mbsopt {

// BlockCholesky's factor. Blocks hold N x N numbers by columns.
struct FactorView {
  int bodies;
  const int* order;         // bodies by elimination position
  const int* first_block;   // per position, and after the last: the first block below the diagonal
  const int* body;          // per block below the diagonal
  const double* W;          // per position: inv(L_kk), unit lower, below the diagonal; else zeros
  const double* L;          // per block below the diagonal
  const double* inverse_D;  // per position, N numbers
};

// Phi_eta of all constraints in space (ConstraintRows).
struct RowsInSpace {
  static constexpr int kUnknowns = 6;  // per body
  struct Group {
    int body1, body2, row, block, rows;  // body 0: the ground
  };
  struct Columns {
    int first = 0, last = 3;  // the columns of displacements in which a row may differ from zero
  };
  struct Body {
    double mass, J[9];
  };
  const Group* groups;
  std::size_t group_count;
  const double *J1, *J2;   // 6 numbers per block row
  const Columns* columns;  // per block row
  const Body* bodies;      // moving ones
  std::size_t body_count;
};

// Phi_eta of all constraints in the plane (PlanarRows).
struct RowsInPlane {
  static constexpr int kUnknowns = 3;
  // A coincidence: [-I, -i x1] of body 1 and [I, i x2] of body 2. The ground's part is left out.
  struct Point {
    int body1, body2, row, row2;
    double x1[2], x2[2];
  };
  // A moving body in a single row.
  struct Entry {
    int body, row;
    double J[3];
  };
  struct Body {
    double mass, inertia;
  };
  const Point* points;
  std::size_t point_count;
  const Entry* entries;
  std::size_t entry_count;
  const Body* bodies;  // moving ones
  std::size_t body_count;
};

// An iterate of BlockSaddleSolver, with its right-hand side b and the residual of J x = g. The arrays must not overlap.
struct SaddleIterate {
  const double *alpha, *b;
  double *x, *nu, *residual;
  std::size_t rows;  // of J
};
struct SaddleSizes {
  double x, residual;  // largest entries; one that is not a number may be missed
};

// A block of MotionBlocks in the same layout.
template <int Rows>
struct [[gnu::may_alias]] alignas(Rows % 2 == 0 ? 16 : 8) MotionBlockView {
  double q[7 * Rows], v[7 * Rows];
  int parts;
};
struct MotionPlace {
  int row, body;
};

// x holds kUnknowns numbers, or rows of lanes, per moving body. y and lambda hold one per row of Phi.
template <class Rows>
struct RowKernels {
  void (*solve)(const FactorView& factor, double* x);                                 // x = inv(S) x
  void (*subtract_times)(const Rows& J, const double* x, double* y);                  // y -= J x
  void (*subtract_transposed_times)(const Rows& J, const double* lambda, double* x);  // x -= J'lambda
  // correction = b - M x - J'(nu - alpha residual); first: x = 0, nu = 0
  void (*load)(const Rows& J, const SaddleIterate& at, bool first, double* correction);
  // x += correction, residual -= J correction, nu -= alpha residual; first: x = correction, nu = -alpha residual
  SaddleSizes (*correct)(const Rows& J, const SaddleIterate& at, bool first, const double* correction);
};

struct BlockKernels {
  // The loops over blocks of six.

  // Factors A = L D L' from the lower triangle of A. It writes inv(L) below the diagonal and zeros elsewhere. Returns
  // false if D is not positive.
  bool (*factor_diagonal)(double* A, double* inverse_D);
  void (*divide)(const double* W, const double* inverse_D, double* A, double* LD);  // LD = A W', A = LD inv(D)
  void (*subtract_product)(const double* A, const double* B, double* C);            // C -= A B'
  // aa += sum_r alpha_r a_r'a_r for rows a_r, b_r of six numbers; bb and ab likewise. Null outputs are skipped.
  void (*add_weighted_squares)(int rows, const double* alpha, const RowsInSpace::Columns* columns, const double* a,
                               const double* b, double* aa, double* bb, double* ab);
  // in_* take a single vector, lanes_in_* take lanes.
  RowKernels<RowsInSpace> in_space;
  RowKernels<RowsInPlane> in_plane;
  RowKernels<RowsInSpace> lanes_in_space;
  RowKernels<RowsInPlane> lanes_in_plane;

  // The loops over lanes.

  // to += the blocks' product with y (7 n rows of q, 7 n of v). first_place has an entry per row and one after the
  // last.
  void (*add_motion_of_bodies)(const MotionBlockView<6>* blocks, const MotionPlace* places, const int* first_place,
                               std::size_t rows, std::size_t n, const double* y, double* to);
  void (*add_motion_of_rows)(const MotionBlockView<1>* blocks, const MotionPlace* places, const int* first_place,
                             std::size_t rows, std::size_t n, const double* y, double* to);
  // q = q0 + sum_j c_j k_j and v = v0 + sum_j d_j k_j of `rows` rows. q may be q0, and v may be v0.
  void (*sum_stages)(std::size_t rows, int terms, const double* const* k, const double* c, const double* d,
                     const double* q0, const double* v0, double* q, double* v);
};

const BlockKernels& block_kernels();  // for this processor

// Each set by itself, for tests. avx2_block_kernels() is null if the program or the processor lacks AVX2.
const BlockKernels& portable_block_kernels();
const BlockKernels* avx2_block_kernels();

}  // namespace mbsopt
