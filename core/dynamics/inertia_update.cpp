#include "core/dynamics/inertia_update.hpp"

#include <algorithm>

#include "core/linear/dense.hpp"

namespace mbsopt {

InertiaUpdate::InertiaUpdate(const MechanismData& data, const Inertias& added) {
  const Eigen::Index size = 6 * static_cast<Eigen::Index>(added.size());
  if (size == 0) return;
  const std::size_t bodies = static_cast<std::size_t>(data.n),
                    groups = static_cast<std::size_t>((size + kLanes - 1) / kLanes);
  Z_.assign(groups, std::vector<Lanes<6>>(bodies, Lanes<6>::Zero()));
  Lambda_.assign(groups, LaneRows::Zero(data.m, kLanes));
  unit_.assign(bodies, Lanes<6>::Zero());
  no_rows_.setZero(data.m, kLanes);
  for (Eigen::MatrixXd* x : {&Mu_, &A_, &inverse_}) x->setZero(size, size);
}

void InertiaUpdate::set(const Inertias& added, SaddleSolver& solver, const SaddleSolver::Settings& settings) {
  const auto body_of = [&](Eigen::Index row) {
    return static_cast<std::size_t>(added[static_cast<std::size_t>(row / 6)].body) - 1;
  };
  for (std::size_t g = 0; g < Z_.size(); ++g) {
    const Eigen::Index first = kLanes * static_cast<Eigen::Index>(g);
    const Eigen::Index last = std::min<Eigen::Index>(first + kLanes, A_.cols());
    for (Eigen::Index c = first; c < last; ++c) unit_[body_of(c)](c % 6, c - first) = 1;
    solver.solve(unit_, no_rows_, settings, Z_[g], Lambda_[g]);
    for (Eigen::Index c = first; c < last; ++c) {
      unit_[body_of(c)].setZero();
      for (Eigen::Index r = 0; r < A_.rows(); ++r) A_(r, c) = Z_[g][body_of(r)](r % 6, c - first);
    }
  }
  if (Z_.empty()) return;
  for (std::size_t i = 0; i < added.size(); ++i) {
    const Eigen::Index at = 6 * static_cast<Eigen::Index>(i);
    Mu_.block<6, 6>(at, at) = added[i].M;
  }
  Eigen::MatrixXd I_AMu = A_ * Mu_;
  I_AMu.diagonal().array() += 1;
  inverse_ = Mu_ * inverse(I_AMu);
}

template <class X, class Multipliers>
void InertiaUpdate::correct_columns(const Inertias& added, std::vector<X>& z, Multipliers& lambda) {
  if (Z_.empty()) return;
  Eigen::MatrixXd w(A_.rows(), X::ColsAtCompileTime);
  for (std::size_t i = 0; i < added.size(); ++i)
    w.middleRows<6>(6 * static_cast<Eigen::Index>(i)) = z[static_cast<std::size_t>(added[i].body) - 1];
  w = (inverse_ * w).eval();
  for (std::size_t g = 0; g < Z_.size(); ++g) {
    const Eigen::Index first = kLanes * static_cast<Eigen::Index>(g);
    const Eigen::Index count = std::min<Eigen::Index>(kLanes, A_.cols() - first);
    for (std::size_t k = 0; k < z.size(); ++k) z[k] -= Z_[g][k].leftCols(count) * w.middleRows(first, count);
    lambda -= Lambda_[g].leftCols(count) * w.middleRows(first, count);
  }
}

void InertiaUpdate::correct(const Inertias& added, std::vector<Vec<6>>& z, Eigen::VectorXd& lambda) {
  correct_columns(added, z, lambda);
}
void InertiaUpdate::correct(const Inertias& added, std::vector<Lanes<6>>& z, LaneRows& lambda) {
  correct_columns(added, z, lambda);
}

}  // namespace mbsopt
