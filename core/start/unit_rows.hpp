// A matrix with its rows scaled to unit length, so that one threshold tells which of them are redundant.
#pragma once

#include <Eigen/Core>

namespace mbsopt {

struct UnitRows {
  static constexpr double kRankThreshold = 1e-8;  // of pivots

  UnitRows() = default;
  explicit UnitRows(const Eigen::MatrixXd& A)
      : scale(A.rowwise().norm().unaryExpr([](double norm) { return norm > 0 ? 1 / norm : 1.0; })),
        J(scale.asDiagonal() * A) {}

  Eigen::VectorXd scale;
  Eigen::MatrixXd J;  // scale A
};

}  // namespace mbsopt
