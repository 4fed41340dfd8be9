#include "core/integrate/stage_matrix.hpp"

namespace mbsopt {
namespace {

// epsilon of a row of Phi in units of the inertia that it sees: far above rounding, far below what matters.
constexpr double kEpsilon = 1e-9;

// A refinement of less than this, relative, is not followed by another.
constexpr double kLastStep = 1e-9;

using Entries = std::vector<SparseLu::Entry>;

void add_block(int row, int column, int rows, int columns, Entries& entries) {
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r < rows; ++r) entries.push_back({row + r, column + c});
  }
}

// The places of all blocks, in the order in which factor() fills them.
Entries entries_of(const MotionJacobian& jacobian, int stages) {
  const int n = 7 * jacobian.bodies(), size = n + jacobian.constraints();
  Entries entries;
  for (int i = 0; i < stages; ++i) {
    for (int j = 0; j < stages; ++j) {
      for (const auto& p : jacobian.pairs()) add_block(i * size + 7 * p.row, j * size + 7 * p.body, 7, 7, entries);
      for (const auto& r : jacobian.rows()) add_block(i * size + n + r.row, j * size + 7 * r.body, 1, 7, entries);
    }
    for (int b = 0; b < jacobian.bodies(); ++b) add_block(i * size + 7 * b, i * size + 7 * b, 7, 7, entries);
    for (const auto& r : jacobian.rows()) add_block(i * size + 7 * r.body, i * size + n + r.row, 6, 1, entries);
    for (int r = 0; r < jacobian.constraints(); ++r) add_block(i * size + n + r, i * size + n + r, 1, 1, entries);
  }
  return entries;
}

}  // namespace

StageMatrix::StageMatrix(const MechanismData& data, const MotionJacobian& jacobian, int stages)
    : jacobian_(&jacobian),
      stages_(stages),
      per_stage_(7 * data.n + data.m),
      lu_(stages * static_cast<int>(per_stage_), entries_of(jacobian, stages)),
      epsilon_(kEpsilon * data.row_alpha.cwiseInverse()) {
  correction_.setZero(size(), kLanes);
  step_.setZero(size(), kLanes);
  P2_.setZero(stages, stages);
}

bool StageMatrix::factor(const Eigen::Ref<const Eigen::MatrixXd>& P,
                         std::span<const MotionJacobian::Values* const> values) {
  std::vector<double>& x = lu_.values();
  std::fill(x.begin(), x.end(), 0.0);
  P2_.noalias() = P.lazyProduct(P);
  std::size_t k = 0;
  auto add = [&](double value) { x[lu_.slot(k++)] += value; };
  for (int i = 0; i < stages_; ++i) {
    const MotionJacobian::Values& at = *values[static_cast<std::size_t>(i)];
    for (int j = 0; j < stages_; ++j) {
      const double p = P(i, j), pp = P2_(i, j);
      for (std::size_t b = 0; b < at.q.size(); ++b) {
        for (Eigen::Index e = 0; e < 49; ++e) add(p * at.v[b].data()[e] + pp * at.q[b].data()[e]);
      }
      for (std::size_t r = 0; r < at.row_q.size(); ++r) {
        for (Eigen::Index e = 0; e < 7; ++e) {
          add(p * at.row_v[r](e) + pp * at.row_q[r](e) + (i == j ? at.J_T[r](e) : 0.0));
        }
      }
    }
    for (const MotionJacobian::Block& mass : at.mass) {
      for (Eigen::Index e = 0; e < 49; ++e) add(mass.data()[e]);
    }
    for (const Mat<1, 6>& J : at.J) {
      for (Eigen::Index e = 0; e < 6; ++e) add(J(e));
    }
    for (Eigen::Index r = 0; r < epsilon_.size(); ++r) add(-at.compliance - epsilon_(r));
  }
  ++factorisations_;
  return lu_.factor();
}

// N = N_epsilon + E:  x += N_epsilon^-1 (b - N x),  and the residual after each pass is -E times its step. A pass whose
// step is so small that the next one's would be below rounding is the last: steps shrink by as much each time.
template <class Solve>
void StageMatrix::refine(Eigen::Ref<Eigen::MatrixXd> b, int refinements, const Solve& solve) {
  solve(b);
  if (epsilon_.size() == 0) return;
  auto step = step_.leftCols(b.cols());
  auto correction = correction_.leftCols(b.cols());
  step = b;
  const double size = b.cwiseAbs().maxCoeff();
  for (int pass = 0; pass < refinements; ++pass) {
    correction.setZero();
    for (int i = 0; i < stages_; ++i) {
      const Eigen::Index row = (i + 1) * per_stage_ - epsilon_.size();
      for (Eigen::Index r = 0; r < epsilon_.size(); ++r) correction.row(row + r) = -epsilon_(r) * step.row(row + r);
    }
    solve(correction);
    b += correction;
    if (correction.cwiseAbs().maxCoeff() < kLastStep * size) return;
    step = correction;
  }
}

void StageMatrix::solve(Eigen::Ref<Eigen::MatrixXd> b, int refinements) {
  refine(b, refinements, [&](Eigen::Ref<Eigen::MatrixXd> x) { lu_.solve(x); });
}

void StageMatrix::solve_transposed(Eigen::Ref<Eigen::MatrixXd> b, int refinements) {
  refine(b, refinements, [&](Eigen::Ref<Eigen::MatrixXd> x) { lu_.solve_transposed(x); });
}

}  // namespace mbsopt
