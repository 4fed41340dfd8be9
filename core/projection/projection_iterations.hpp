// Projections in space and in the plane share the iteration onto the constraints and the refinement of the linear
// systems of its derivatives. Rows gives J and M: ConstraintRows or PlanarRows.
#pragma once

#include <cmath>
#include <vector>

#include "core/dynamics/saddle_solver.hpp"

namespace mbsopt {

inline constexpr double kProjectionAlpha = 1e8;  // times row_alpha
inline constexpr int kMostProjectionIterations = 60;
// Positions are relative to the largest coordinate, velocities to the largest velocity, or to 1 if these are smaller.
inline constexpr double kProjectionRounding = 1e-15, kUnmetPosition = 1e-8, kUnmetVelocity = 1e-6;
// The largest number of refinements of a derivative. A relative change of a few units of rounding ends it earlier.
inline constexpr int kMostRefinements = 12;
inline constexpr double kNegligibleRefinement = 2e-15;

// The largest entry of each direction.
template <class X>
using LargestEntries = Eigen::Array<double, 1, X::ColsAtCompileTime>;
template <class X>
LargestEntries<X> largest(const std::vector<X>& x) {
  LargestEntries<X> most;
  most.setZero();
  for (const X& xi : x) most = most.max(xi.cwiseAbs().colwise().maxCoeff().array());
  return most;
}

// Scratch for corrections to unknowns x per body and multipliers nu: right-hand sides, and the corrections themselves.
template <class X, class Y>
struct Corrections {
  std::vector<X> r, dx, Ex;
  Y rg, dnu;
};

// Iterates from x = 0 and nu = 0 until M x + J~'nu = 0 and phi = 0 hold to rounding, J~ that of `rows`, by
//   [ M J'; J 0 ] (dx, dnu) = -(M x + J~'nu, phi)        J: of the solver's factor
// evaluate(phi) computes phi at x, and move(dx) moves the bodies to x + dx. Returns false if phi is not finite or stays
// above unmet.
template <class Rows, class X, class Evaluate, class Move>
bool onto_constraints(BlockSaddleSolver<Rows>& solver, const Rows& rows, double size, double unmet, std::vector<X>& x,
                      Eigen::VectorXd& nu, Corrections<X, Eigen::VectorXd>& c, Evaluate&& evaluate, Move&& move) {
  for (X& xi : x) xi.setZero();
  nu.setZero();
  if (nu.size() == 0) return true;
  double before = INFINITY, now = 0;
  for (int k = 0; k < kMostProjectionIterations; ++k) {
    evaluate(c.rg);
    now = c.rg.cwiseAbs().maxCoeff();
    if (!std::isfinite(now)) return false;
    if (now < kProjectionRounding * size || (k > 1 && now > 0.95 * before))
      break;  // rounding reached, or a singular position
    before = now;
    for (std::size_t i = 0; i < x.size(); ++i) c.r[i] = -solver.mass_times(static_cast<int>(i) + 1, x[i]);
    rows.subtract_transposed_times(nu, c.r);
    c.rg = -c.rg;
    solver.solve(c.r, c.rg, Refinements{}, c.dx, c.dnu);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += c.dx[i];
    nu += c.dnu;
    move(c.dx);
  }
  return now <= unmet * size;
}

enum class ProjectionLevel { position, velocity };

// Solves, with J~ = J(q~) of the solver and J = J(q) of `rows`, its columns of turns times E at the position level,
//   [ M  J~' ] or, transposed,  [ M  E'J' ]        (velocity level: [ M J'; J 0 ], symmetric)
//   [ JE  0  ]                  [ J~  0   ]
// by x += K (rhs - B x) with K the approximate inverse from the factor of S(q~). `x` is added to directions, so its
// rounding is relative to these. turn(x, transposed) computes x = E x or E'x. Each pass gains a factor of about the
// correction's size, or of 1/alpha times the ratio of the coupled masses.
template <class Rows, class X, class Y, class Turn>
void refine(BlockSaddleSolver<Rows>& solver, const Rows& rows, ProjectionLevel level, bool transposed,
            const LargestEntries<X>& directions, const std::vector<X>& b, const Y& g, std::vector<X>& x, Y& nu,
            Corrections<X, Y>& c, Turn&& turn) {
  solver.solve(b, g, Refinements{}, x, nu);
  if (nu.rows() == 0) return;
  LargestEntries<X> before = largest(x);
  const LargestEntries<X> size = before.max(directions);
  for (int k = 0; k < kMostRefinements; ++k) {
    for (std::size_t i = 0; i < x.size(); ++i) c.r[i] = b[i] - solver.mass_times(static_cast<int>(i) + 1, x[i]);
    c.rg = g;
    if (level == ProjectionLevel::velocity) {
      rows.subtract_transposed_times(nu, c.r);
      rows.subtract_times(x, c.rg);
    } else if (!transposed) {
      solver.rows().subtract_transposed_times(nu, c.r);
      c.Ex = x;
      turn(c.Ex, false);
      rows.subtract_times(c.Ex, c.rg);
    } else {
      for (X& e : c.Ex) e.setZero();
      rows.subtract_transposed_times(nu, c.Ex);
      turn(c.Ex, true);
      for (std::size_t i = 0; i < x.size(); ++i) c.r[i] += c.Ex[i];
      solver.rows().subtract_times(x, c.rg);
    }
    solver.solve(c.r, c.rg, Refinements{}, c.dx, c.dnu);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += c.dx[i];
    nu += c.dnu;
    const LargestEntries<X> now = largest(c.dx);
    if ((now * now <= kNegligibleRefinement * size * before).all()) return;
    before = now;
  }
}

}  // namespace mbsopt
