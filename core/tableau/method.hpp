// Runge-Kutta methods as tables. Step, tangent-linear and adjoint are written once and read these.
//
//   Y_i = y0 + h sum_j A_ij k_j,   k_i = f(t0 + c_i h, Y_i),   y1 = y0 + h sum_i b_i k_i
//   dense output:  y(t0 + theta h) = y0 + h sum_i b_i(theta) k_i,   b_i(theta) = sum_j dense_ij theta^(j+1)
//
// Stages beyond the first S serve dense output only and are computed on demand. The error of a step is the norm of err
// = h sum_i error_i k_i. If the table has error_low, the two are combined as in DOP853. If it has error_filter = g, (I
// - h g f_y)^-1 err replaces err, which bounds it in stiff directions.
//
// Stages that need each other are solved together: a group is first..last with A_ij = 0 for i <= last < j. In an
// explicit method every group is one stage with A_ii = 0. In a diagonally implicit one A_ii may differ from 0.
//
// A Rosenbrock method has a second table, gamma, with equal numbers on its diagonal. Its stages solve linear equations:
//
//   k_i = f(t0 + c_i h, Y_i) + h f_y(t0, y0) sum_j gamma_ij k_j + h gamma_i f_t(t0, y0),   gamma_i = sum_j gamma_ij
//
// Hairer, Wanner, "Solving Ordinary Differential Equations II" (1996), section IV.7. Its Y_i are of low order. So
// running costs are integrated along the dense output: nodes of a Gauss rule replace the stages.
//
// A new method is a table in a file of its kind (explicit_tableaus.hpp, implicit_tableaus.hpp, or its own) and a name
// in the list of tableaus.cpp. The tests run over that list.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace mbsopt {

template <int S, int T = S>  // stages of the step, and with those of dense output
struct Tableau {
  std::string_view name;
  int order = 0, dense_order = 0;
  int error_order = 0;  // the error estimate is O(h^error_order) where the motion is smooth; 0: no estimate
  std::array<double, T> c{};
  std::array<std::array<double, T>, T> A{};
  std::array<double, S> b{};
  std::array<double, S> error{};      // b - b^, all zero: no estimate, fixed steps only
  std::array<double, S> error_low{};  // a second, lower estimate
  double error_filter = 0;
  std::array<std::array<double, 7>, T> dense{};
  std::array<std::array<double, T>, T> gamma{};  // of a Rosenbrock method
  std::array<double, T> gamma_sum{};             // gamma_i
};

constexpr double magnitude(double x) { return x < 0 ? -x : x; }

template <std::size_t T>
constexpr bool rows_sum_to(const std::array<double, T>& c, const std::array<std::array<double, T>, T>& A) {
  for (std::size_t i = 0; i < T; ++i) {
    double sum = -c[i], size = 1;
    for (const double a : A[i]) {
      sum += a;
      size += magnitude(a);
    }
    if (magnitude(sum) > 1e-15 * size) return false;
  }
  return true;
}
// Dense output ends at y1: b_i(1) = b_i.
template <int S, int T>
constexpr bool dense_ends_at_step(const Tableau<S, T>& rk) {
  for (std::size_t i = 0; i < T; ++i) {
    double sum = i < S ? -rk.b[i] : 0.0, size = 1;
    for (const double d : rk.dense[i]) {
      sum += d;
      size += magnitude(d);
    }
    if (magnitude(sum) > 1e-15 * size) return false;
  }
  return true;
}

// Stages first..last are coupled and solved together.
struct StageGroup {
  int first = 0, last = 0;
  int size() const { return last - first + 1; }
};

// A tableau with its sizes as data, so that a step is written once and compiled once.
struct Method {
  static constexpr int kMaxStages = 16;

  std::string_view name;
  int order = 0, dense_order = 0, error_order = 0;
  int stages = 0, dense_stages = 0;  // of the step; with those of dense output
  const double* c = nullptr;
  const double* A = nullptr;  // dense_stages x dense_stages, row by row
  const double* b = nullptr;
  const double* error = nullptr;
  const double* error_low = nullptr;  // null: none
  const double* dense = nullptr;      // dense_stages x 7
  const double* gamma = nullptr;      // dense_stages x dense_stages; null: not a Rosenbrock method
  const double* gamma_sum = nullptr;  // of its rows
  int nodes = 0;                      // of running costs: psi += sum_m h node_b_m g(t0 + node_c_m h), m < nodes
  const double* node_c = nullptr;     // c, b: node m is stage m; otherwise nodes are on the dense output
  const double* node_b = nullptr;
  double error_filter = 0;        // 0: none
  bool adaptive = false;          // has an error estimate
  bool stiffly_accurate = false;  // y1 is the last implicit stage: b is its row of A
  std::array<StageGroup, kMaxStages> group{};
  int groups = 0, step_groups = 0;

  double a(int i, int j) const { return A[i * dense_stages + j]; }
  double gamma_of(int i, int j) const { return gamma[i * dense_stages + j]; }
  // The upper half of k_i is v0 + h sum_j beta_ij a_j, since qdot = v.
  double beta(int i, int j) const { return gamma ? a(i, j) + gamma_of(i, j) : a(i, j); }
  double dense_weight(int i, double theta) const {
    double x = 0;
    for (int j = 6; j >= 0; --j) x = (x + dense[7 * i + j]) * theta;
    return x;
  }
  // d b_i/d theta
  double dense_weight_rate(int i, double theta) const {
    double x = 0;
    for (int j = 6; j >= 0; --j) x = x * theta + (j + 1) * dense[7 * i + j];
    return x;
  }

  // The groups of coupled stages, in the order of their computation; those of the step come first.
  std::span<const StageGroup> stage_groups() const { return {group.data(), static_cast<std::size_t>(groups)}; }
  std::span<const StageGroup> stage_groups_of_step() const {
    return {group.data(), static_cast<std::size_t>(step_groups)};
  }
  // Y_i is computed from earlier stages alone.
  bool is_explicit_stage(int i) const {
    for (int j = i; j < dense_stages; ++j) {
      if (a(i, j) != 0) return false;
    }
    return true;
  }
  bool implicit() const {
    if (gamma) return true;
    for (int i = 0; i < dense_stages; ++i) {
      if (!is_explicit_stage(i)) return true;
    }
    return false;
  }
};

inline bool is_implicit(const Method& rk, const StageGroup& g) { return !rk.is_explicit_stage(g.first); }

// The number of stages of the largest implicit group; 0 if the method is explicit.
inline int largest_implicit_group(const Method& rk) {
  int largest = 0;
  for (const StageGroup& g : rk.stage_groups()) {
    if (is_implicit(rk, g)) largest = std::max(largest, g.size());
  }
  return largest;
}

// Returns whether a step's result depends on the group through its weights, dense output, or later stages. An error
// estimate does not count, because derivatives hold steps fixed.
inline bool is_used(const Method& rk, const StageGroup& g, bool dense) {
  if (dense) return true;
  for (int i = g.first; i <= std::min(g.last, rk.stages - 1); ++i) {
    if (rk.b[i] != 0) return true;
    for (int k = g.last + 1; k < rk.stages; ++k) {
      if (rk.a(k, i) != 0) return true;
    }
  }
  return false;
}

}  // namespace mbsopt
