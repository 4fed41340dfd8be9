// The derivative x' of the point nearest to a guess (nearest_point.hpp), with H = I + sum_i nu_i F_i,xx:
//
//   H x' + J'nu' = g,  J x' = b          g = x_guess' - (J'nu)' at fixed x,   b = -F' at fixed x
//   x' = J+ b + Z (Z'H Z)^-1 Z'(g - H J+ b)          Z: orthonormal basis of the null space of J
//
// J may be rank deficient (redundant equations). It is decomposed with unknowns in units of their sizes. Z separates
// the parts that equations join, and pure translations (or pure turns). So a mechanism of micrometres or of kilometres
// loses few digits between metres and Euler parameters, which rounding() estimates. Nocedal and Wright, "Numerical
// Optimization" (2006), section 16.2 (null-space method).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/linear/dense.hpp"

namespace mbsopt {

// A matrix with its rows scaled to unit length, so that one threshold tells which of them are redundant.
struct UnitRows {
  static constexpr double kRankThreshold = 1e-8;  // of pivots

  UnitRows() = default;
  explicit UnitRows(const Eigen::MatrixXd& A)
      : scale(A.rowwise().norm().unaryExpr([](double norm) { return norm > 0 ? 1 / norm : 1.0; })),
        J(scale.asDiagonal() * A) {}

  Eigen::VectorXd scale;
  Eigen::MatrixXd J;  // scale A
};

// Rows of a matrix and unknowns that their entries join.
struct JoinedPart {
  std::vector<Eigen::Index> rows, unknowns;
};
std::vector<JoinedPart> joined_parts(const Eigen::MatrixXd& A);

// J decomposed at one point, and the solution of the linear system.
class NearestPointLinearisation {
 public:
  static constexpr double kRankThreshold = UnitRows::kRankThreshold;

  NearestPointLinearisation() = default;
  NearestPointLinearisation(const Eigen::MatrixXd& J, const Eigen::VectorXd& sizes);

  Eigen::Index rank() const { return J_transposed_.rank(); }
  const Eigen::VectorXd& row_scale() const { return scale_; }
  const Eigen::VectorXd& sizes() const { return sizes_; }
  // Returns the residual b - J x, with rows of J scaled to unit length.
  Eigen::MatrixXd left(const Eigen::MatrixXd& b, const Eigen::MatrixXd& x) const {
    return scale_.asDiagonal() * (b - J_ * x);
  }
  const Eigen::MatrixXd& null_space() const { return Z_; }      // Z
  Eigen::MatrixXd multipliers(const Eigen::MatrixXd& g) const;  // least nu with J'nu = g
  // Returns nu with J'nu = x_guess - x, as exact as x is: to eps of each unknown's size.
  Eigen::VectorXd multipliers_at(const Eigen::VectorXd& away) const;
  Eigen::MatrixXd pseudo_inverse_times(const Eigen::MatrixXd& b) const;  // J+ b

  // Call this before solve and solve_transposed.
  void set_hessian(const Eigen::MatrixXd& H);
  // Eigenvalues of Z'HZ, ascending: all positive at a strict minimum.
  const Eigen::VectorXd& reduced_eigenvalues() const { return lambda_; }

  Eigen::MatrixXd solve(const Eigen::MatrixXd& b, const Eigen::MatrixXd& g) const;
  // The adjoint: finds b_bar and g_bar with x_bar'x' = b_bar'b + g_bar'g.
  void solve_transposed(const Eigen::MatrixXd& x_bar, Eigen::MatrixXd& b_bar, Eigen::MatrixXd& g_bar) const;
  // The rounding of x = solve(b, g), whose part along Z sums large terms: eps |Z| |Z'HZ|^-1 |Z|'(|g| + |H| |x|). The
  // largest over all unknowns and columns, each relative to the largest unknown, in units of the sizes.
  double rounding(const Eigen::MatrixXd& x, const Eigen::MatrixXd& g) const;

 private:
  Eigen::MatrixXd particular(const Eigen::MatrixXd& b) const;  // some x with J x = b
  Eigen::MatrixXd free_part(const Eigen::MatrixXd& gap) const;

  Eigen::MatrixXd J_;
  Eigen::VectorXd scale_, sizes_;         // of the rows and of the columns of J
  OrthogonalDecomposition J_transposed_;  // of (scale J sizes)'
  Eigen::MatrixXd Z_, H_, V_;             // Z'HZ = V diag(lambda) V'
  Eigen::VectorXd lambda_;
};

}  // namespace mbsopt
