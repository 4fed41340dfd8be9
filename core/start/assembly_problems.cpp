#include "core/start/assembly_problems.hpp"

#include <cmath>

#include "core/body/state_layout.hpp"

namespace mbsopt {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd position_guess(const MechanismData& d) {
  const StateLayout layout{d.n};
  VectorXd q(layout.positions());
  for (std::size_t k = 1; k < d.bodies.size(); ++k) q.segment<7>(layout.q(k)) = d.bodies[k].q;
  return q;
}

VectorXd sizes_of_poses(const MatrixXd& J) {
  double r = 0, p = 0;
  for (Index k = 0; k < J.cols(); k += 7) {
    for (Index i = 0; i < J.rows(); ++i) {
      const double here = J.row(i).segment<3>(k).squaredNorm();
      if (here > 0) r += here, p += J.row(i).segment<4>(k + 3).squaredNorm();
    }
  }
  const double length = p > 0 ? std::sqrt(p / r) : 1;
  VectorXd sizes = VectorXd::Ones(J.cols());
  for (Index k = 0; k < J.cols(); k += 7) sizes.segment<3>(k).setConstant(length);
  return sizes;
}

VectorXd magnitudes_of_terms(Index rows, const std::vector<SparseEntry>& J, Index first, const VectorXd& x) {
  VectorXd sums = VectorXd::Zero(rows);
  for (const SparseEntry& e : J) {
    const Index k = e.column - first;
    if (k < 0 || k >= x.size()) continue;
    const Index body = k / 7 * 7;
    const double part =
        k - body < 3 ? x.segment<3>(body).lpNorm<Eigen::Infinity>() : x.segment<4>(body + 3).lpNorm<Eigen::Infinity>();
    sums(e.row) += std::abs(e.value) * part;
  }
  return sums;
}

}  // namespace mbsopt
