// Rank and redundant equations by Gram-Schmidt on whole rows, which tells slowly what Assembly::summary() tells fast.
#pragma once

#include <string>
#include <vector>

#include "core/constraint/constraint.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/start/assembly_equations.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt::testing {

// Per row of J, in its order: whether it is independent of those before.
inline std::vector<bool> dense_independent_rows(const Eigen::MatrixXd& J, double threshold) {
  std::vector<bool> independent;
  Eigen::MatrixXd basis(J.cols(), J.cols());
  Eigen::Index rank = 0;
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    Eigen::VectorXd x = J.row(i).transpose().normalized();
    for (int twice = 0; twice < 2; ++twice) x -= basis.leftCols(rank) * (basis.leftCols(rank).transpose() * x);
    const bool is_one = rank < basis.cols() && x.norm() > threshold;
    if (is_one) basis.col(rank++) = x.normalized();
    independent.push_back(is_one);
  }
  return independent;
}

struct DenseRedundancy {
  int rank = 0;
  std::vector<std::string> redundant;
};

inline DenseRedundancy dense_redundancy(const MechanismData& d, double t, const Eigen::VectorXd& y) {
  AssemblyEquations equations(d, AssemblyLevel::position, t);
  equations.start_branches(y);
  const Eigen::MatrixXd all = equations.gradients(y).y.leftCols(7 * d.n);
  Eigen::MatrixXd J(d.m + d.n, 7 * d.n);
  J << all.middleRows(d.m, d.n), all.topRows(d.m);
  const std::vector<bool> independent = dense_independent_rows(J, NearestPointLinearisation::kRankThreshold);
  DenseRedundancy result;
  for (const bool is_one : independent) result.rank += is_one ? 1 : 0;
  const int joints = static_cast<int>(d.joint_names.size()), drives = static_cast<int>(d.drive_names.size());
  for (int owner = 0; owner < joints + drives; ++owner) {
    int rows = 0, redundant = 0, next_row = 0;
    for (const Constraint& c : d.constraints) {
      const bool is_new = c.row >= next_row;
      next_row = std::max(next_row, c.row + c.rows());
      if (!is_new || (c.drive >= 0 ? joints + c.drive : c.joint) != owner) continue;
      rows += c.rows();
      for (int i = 0; i < c.rows(); ++i) redundant += independent[static_cast<std::size_t>(d.n + c.row + i)] ? 0 : 1;
    }
    if (redundant == 0) continue;
    const std::string& name = owner < joints ? d.joint_names[static_cast<std::size_t>(owner)]
                                             : d.drive_names[static_cast<std::size_t>(owner - joints)];
    result.redundant.push_back(name + " (" + std::to_string(redundant) + " of " + std::to_string(rows) + ")");
  }
  return result;
}

}  // namespace mbsopt::testing
