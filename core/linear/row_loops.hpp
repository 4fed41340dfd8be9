// The loops of RowKernels (kernel_table.hpp) for a type of number: Row, a row of lanes in a register, or one number.
#pragma once

#include "core/linear/kernel_table.hpp"

namespace mbsopt {
namespace {  // of each file its own: compiled for different processors

// One number of a single vector in place of a row of lanes. It may alias doubles, because its only member is one.
struct One {
  double x;

  One& operator+=(const One& y) { return x += y.x, *this; }
  One& operator-=(const One& y) { return x -= y.x, *this; }
  One& operator*=(double s) { return x *= s, *this; }
  friend One operator+(const One& a, const One& b) { return {a.x + b.x}; }
  friend One operator-(const One& a, const One& b) { return {a.x - b.x}; }
  friend One operator*(double s, const One& a) { return {s * a.x}; }

  static One zero() { return {0}; }
  void grow_to(const One& y) {
    const double size = __builtin_fabs(y.x);  // no branch
    x = x > size ? x : size;
  }
  double largest() const { return x; }
};

template <class Row>
class RowLoops {
 public:
  template <class Jacobian>
  static constexpr RowKernels<Jacobian> kernels() {
    return {
        .solve = &solve<Jacobian::kUnknowns>,
        .subtract_times = [](const Jacobian& J, const double* x, double* y) { subtract_times(J, rows(x), rows(y)); },
        .subtract_transposed_times =
            [](const Jacobian& J, const double* lambda, double* x) {
              subtract_transposed(
                  J, [l = rows(lambda)](int r) { return l[r]; }, rows(x));
            },
        .load = &load<Jacobian>,
        .correct = &correct<Jacobian>};
  }

 private:
  static Row* rows(double* x) { return reinterpret_cast<Row*>(x); }
  static const Row* rows(const double* x) { return reinterpret_cast<const Row*>(x); }

  // x = W x and x = W'x for unit lower W; y -= L x and y -= L'x. All go by columns.
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
    Row sum[N];
#pragma GCC unroll 6
    for (int i = 0; i < N; ++i) sum[i] = y[i];
#pragma GCC unroll 6
    for (int j = 0; j < N; ++j) {
      const Row xj = x[j];
#pragma GCC unroll 6
      for (int i = 0; i < N; ++i) sum[i] -= L[i + N * j] * xj;
    }
#pragma GCC unroll 6
    for (int i = 0; i < N; ++i) y[i] = sum[i];
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
        sum -= a[0] * from[0];
        sum -= a[1] * from[1];
        sum -= a[2] * from[2];
      }
      sum -= a[3] * x3;
      sum -= a[4] * x4;
      sum -= a[5] * x5;
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

  // x -= J'lambda of a group. lambda(row) returns the row's multiplier.
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
        to[0] -= a[0] * l;
        to[1] -= a[1] * l;
        to[2] -= a[2] * l;
      }
      x3 -= a[3] * l;
      x4 -= a[4] * l;
      x5 -= a[5] * l;
    }
    to[3] = x3;
    to[4] = x4;
    to[5] = x5;
  }
  template <class Lambda>
  static void subtract_transposed(const RowsInSpace& J, const Lambda& lambda, Row* x) {
    for (std::size_t k = 0; k < J.group_count; ++k) {
      const RowsInSpace::Group& g = J.groups[k];
      if (g.body1 > 0) subtract_transposed_times(J, g, J.J1 + 6 * g.block, lambda, x + 6 * (g.body1 - 1));
      if (g.body2 > 0) subtract_transposed_times(J, g, J.J2 + 6 * g.block, lambda, x + 6 * (g.body2 - 1));
    }
  }

  // Points and entries are copies: lanes may alias them, so each store to x or y would force another read.
  static void subtract_times(const RowsInPlane& J, const Row* x, Row* y) {
    const auto [points, point_count, entries, entry_count, bodies, body_count] = J;
    for (std::size_t k = 0; k < point_count; ++k) {
      const RowsInPlane::Point p = points[k];
      Row first = y[p.row], second = y[p.row2];
      if (p.body2 > 0) {
        const Row* b = x + 3 * (p.body2 - 1);
        first -= b[0] - p.x2[1] * b[2];
        second -= b[1] + p.x2[0] * b[2];
      }
      if (p.body1 > 0) {
        const Row* b = x + 3 * (p.body1 - 1);
        first += b[0] - p.x1[1] * b[2];
        second += b[1] + p.x1[0] * b[2];
      }
      y[p.row] = first;
      y[p.row2] = second;
    }
    for (std::size_t k = 0; k < entry_count; ++k) {
      const RowsInPlane::Entry e = entries[k];
      const Row* b = x + 3 * (e.body - 1);
      y[e.row] -= e.J[0] * b[0] + e.J[1] * b[1] + e.J[2] * b[2];
    }
  }
  template <class Lambda>
  static void subtract_transposed(const RowsInPlane& J, const Lambda& lambda, Row* x) {
    const auto [points, point_count, entries, entry_count, bodies, body_count] = J;
    for (std::size_t k = 0; k < point_count; ++k) {
      const RowsInPlane::Point p = points[k];
      const Row first = lambda(p.row), second = lambda(p.row2);
      if (p.body2 > 0) {
        Row* b = x + 3 * (p.body2 - 1);
        b[0] -= first;
        b[1] -= second;
        b[2] -= p.x2[0] * second - p.x2[1] * first;
      }
      if (p.body1 > 0) {
        Row* b = x + 3 * (p.body1 - 1);
        b[0] += first;
        b[1] += second;
        b[2] += p.x1[0] * second - p.x1[1] * first;
      }
    }
    for (std::size_t k = 0; k < entry_count; ++k) {
      const RowsInPlane::Entry e = entries[k];
      const Row l = lambda(e.row);
      Row* b = x + 3 * (e.body - 1);
      for (int i = 0; i < 3; ++i) b[i] -= e.J[i] * l;
    }
  }

  // y = b - M x
  static void subtract_mass_times(const RowsInSpace::Body& m, const Row* b, const Row* x, Row* y) {
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) y[i] = b[i] - m.mass * x[i];
#pragma GCC unroll 3
    for (int i = 0; i < 3; ++i) y[3 + i] = b[3 + i] - m.J[i] * x[3] - m.J[i + 3] * x[4] - m.J[i + 6] * x[5];
  }
  static void subtract_mass_times(const RowsInPlane::Body& m, const Row* b, const Row* x, Row* y) {
    y[0] = b[0] - m.mass * x[0];
    y[1] = b[1] - m.mass * x[1];
    y[2] = b[2] - m.inertia * x[2];
  }

  template <class Jacobian>
  static void load(const Jacobian& J, const SaddleIterate& at, bool first, double* numbers) {
    constexpr int N = Jacobian::kUnknowns;
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

  template <class Jacobian>
  static SaddleSizes correct(const Jacobian& J, const SaddleIterate& at, bool first, const double* correction) {
    constexpr int N = Jacobian::kUnknowns;
    Row* const x = rows(at.x);
    Row* const nu = rows(at.nu);
    Row* const residual = rows(at.residual);
    const Row* const dx = rows(correction);
    Row largest_x = Row::zero(), largest_residual[2] = {Row::zero(), Row::zero()};  // of even and odd rows
    for (std::size_t k = 0; k < J.body_count; ++k) {
      Row of_body = Row::zero();  // chains of comparisons are short: each waits for the one before
#pragma GCC unroll 6
      for (std::size_t i = 0; i < N; ++i) {
        const Row step = dx[N * k + i], sum = first ? step : x[N * k + i] + step;
        x[N * k + i] = sum;
        of_body.grow_to(sum);
      }
      largest_x.grow_to(of_body);
    }
    subtract_times(J, dx, residual);
    const auto correct_row = [&](std::size_t r, Row& largest) {
      const Row s = residual[r];
      nu[r] = first ? -at.alpha[r] * s : nu[r] - at.alpha[r] * s;
      largest.grow_to(s);
    };
    std::size_t r = 0;
    for (; r + 2 <= at.rows; r += 2) {
      correct_row(r, largest_residual[0]);
      correct_row(r + 1, largest_residual[1]);
    }
    if (r < at.rows) correct_row(r, largest_residual[0]);
    largest_residual[0].grow_to(largest_residual[1]);
    return {largest_x.largest(), largest_residual[0].largest()};
  }
};

}  // namespace
}  // namespace mbsopt
