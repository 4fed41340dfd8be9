#include "core/start/assembly_problems.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"
#include "core/constraint/unit_norm.hpp"

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

MatrixXd rates_of_poses(const VectorXd& q, const MatrixXd& xi) {
  MatrixXd qdot(q.size(), xi.cols());
  for (Index k = 0; k < xi.cols(); ++k) {
    for (Index r = 0; r < q.size(); r += 7) {
      const Vec<6> of_body = xi.col(k).segment<6>(r / 7 * 6);
      qdot.col(k).segment<3>(r) = of_body.head<3>();
      qdot.col(k).segment<4>(r + 3) = 0.5 * G_transposed_times(Vector4d(q.segment<4>(r + 3)), of_body.tail<3>());
    }
  }
  return qdot;
}

// No Euler parameter changes by more than 0.3 in one step (about 0.6 rad); r and v enter linearly.
double AssemblyProblem::step_fraction(const VectorXd& step) const {
  double change = 0;
  for (Index i = 3; i < step.size() && !q_; i += 7)
    change = std::max(change, step.segment<4>(i).lpNorm<Eigen::Infinity>());
  return change > 0.3 ? 0.3 / change : 1.0;
}

VectorXd AssemblyProblem::retracted(const VectorXd& x) const {
  VectorXd out = x;
  for (Index i = 3; i < x.size() && !q_; i += 7) out.segment<4>(i) = UnitNorm::project(x.segment<4>(i));
  return out;
}

VectorXd AssemblyProblem::magnitudes(const VectorXd& x) const {
  VectorXd sums = VectorXd::Zero(equations_.rows());
  for (const SparseEntry& e : equations_.sparse_gradients(state(x)).y) {
    const Index k = e.column - first(x), body = k / 7 * 7;
    if (k < 0 || k >= x.size()) continue;
    const double part =
        k - body < 3 ? x.segment<3>(body).lpNorm<Eigen::Infinity>() : x.segment<4>(body + 3).lpNorm<Eigen::Infinity>();
    sums(e.row) += std::abs(e.value) * part;
  }
  return sums;
}

VectorXd AssemblyProblem::state(const VectorXd& x) const {
  VectorXd y = VectorXd::Zero(2 * x.size());
  if (q_) y.head(x.size()) = *q_;
  y.segment(first(x), x.size()) = x;
  return y;
}

}  // namespace mbsopt
