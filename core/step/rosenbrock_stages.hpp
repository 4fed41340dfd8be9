// The stages of a Rosenbrock step (method.hpp), and their linearisation. One linear system, with g = gamma_ii:
//
//   (I - h g f_y) x_i = f(t0 + c_i h, Y_i) + s_i + gamma_i h f_t,    s_i = sum_{j<i} gamma_ij/g k_j,    k_i = x_i - s_i
//
// f_y is exact. Since h f_y sum_j gamma_ij k_j + gamma_i h f_t is a derivative of f along the direction (h gamma_i,
// u_i) of (t, y), u_i = h sum_{j<=i} gamma_ij k_j, the derivative of a stage in y0 and in the parameters is
//
//   (I - h g f_y) x_i' = f_y(Y_i) Y_i' + f_rho + s_i' + d/de [ f_y(e) y0' + f_rho(e) ],     e = 0
//   f_y(e), f_rho(e): at t0 + e h gamma_i, y0 + e u_i
//
// This derivative D(h gamma_i, u_i) is linear in the direction, and all stages have most of theirs in common:
//
//   D(h gamma_i, u_i) = gamma_i D(h, h k_0) + D(0, w_i),   w_i = h sum_{0<j<=i} gamma_ij (k_j - k_0)
//
// w_i is O(h^2), and w_0 = 0. D(h, h k_0) comes from exact first derivatives at e = 0, d, .., 4 d by a formula of order
// 4: points stay on the step's side of t0, where a law may have a kink. D(0, w_i) comes from those at e = -d, d. Both
// sweeps use the same formulas, so that they are transposes of each other. f_t is taken by the formula of order 4.
#pragma once

#include <algorithm>
#include <array>

#include "core/dynamics/dynamics.hpp"
#include "core/run/simulation_result.hpp"
#include "core/step/shifted_system.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

class RosenbrockStages {
 public:
  RosenbrockStages(const Mechanism& mechanism, const Method& method, Dynamics& dynamics);

  // f and f_y at the start of the step, for all attempts from there. False: not finite.
  bool begin(const Step& step);
  // All stages of an attempt of size step.h into Y and K. False: a matrix cannot be factored, or f is not finite.
  bool solve(Step& step);

  // For the sweeps, whose step is solved: f_y at the start and the factor of I - h g f_y.
  bool factor(const Step& step);
  void solve(Eigen::Ref<Eigen::MatrixXd> x) { matrix_.solve(x, StageMatrix::kExact); }
  void solve_transposed(Eigen::MatrixXd& x) {  // any number of columns
    for (Eigen::Index first = 0; first < x.cols(); first += kLanes)
      matrix_.solve_transposed(x.middleCols(first, std::min<Eigen::Index>(kLanes, x.cols() - first)),
                               StageMatrix::kExact);
  }
  // Linearises the dynamics at Y_i; and at the points of D: e = k d along (h, h k_0), k = 0..4; e = sign d along w_i.
  static constexpr int kPoints = 5;
  bool linearise_stage(const Step& step, int i);
  bool linearise_common(const Step& step, int k);
  bool linearise_own(const Step& step, int i, int sign);
  // D is the sum of these times the values at its points.
  static constexpr double common_weight(int k) { return kWeights[static_cast<std::size_t>(k)] / kSpacing; }
  static constexpr double own_weight(int sign) { return sign * 0.5 / kSpacing; }

  void add_to(SimulationStatistics& statistics) const {  // the work of begin() and the first solve()
    statistics.rhs_evaluations += evaluations_;
    statistics.linear_solves += evaluations_ + solves_;
    statistics.jacobians += jacobians_;
    statistics.factorisations += factorisations();
  }
  long linearised_states() const { return linearised_; }
  long factorisations() const { return matrix_.factorisations(); }

 private:
  // d, a power of two: of a step, since k_0 is f. The formula of order 4 leaves out (1/256)^4/5 = 5e-11 times (h/T)^5,
  // T the time in which the motion changes: 5e-14 for steps whose error is 1e-6. Rounding leaves 10 * 64 * 1e-16, as
  // gamma_i is a quarter at most. The central formula leaves out d^2/6 |w_i|^3 / T^3 and w_i is about 0.1 h^2/T: 3e-15
  // for such steps, whose h/T is a tenth.
  static constexpr double kSpacing = 1.0 / 256;
  static constexpr std::array<double, kPoints> kWeights{-25.0 / 12, 4, -3, 4.0 / 3, -1.0 / 4};
  bool linearise_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles);

  const Method& rk_;
  Dynamics& dynamics_;
  ShiftedSystem matrix_;
  Eigen::VectorXd f_, f_t_, y_, ydot_, s_, x_;  // f_t_: times h
  long evaluations_ = 0, jacobians_ = 0, solves_ = 0, linearised_ = 0;
};

}  // namespace mbsopt
