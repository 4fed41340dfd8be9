#include "core/step/stage_matrix.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"

namespace mbsopt {
namespace {

// epsilon of a row of Phi in units of the inertia that it sees. Its truncation error and the rounding of W = 1/epsilon
// are about equal.
constexpr double kRelativeEpsilon = 1e-8;

// Relative, of what is left. Multipliers have ten times the rounding of accelerations, W's.
constexpr double kNegligible = 2e-14;
constexpr double kWrong = 1e-4;  // relative residual of forces from which a factor is not used
constexpr int kSparseRun = 20;   // factorisations by the sparse LU after one that was not

}  // namespace

StageMatrix::StageMatrix(const MechanismData& data, const MotionJacobian& jacobian, int stages)
    : jacobian_(&jacobian),
      stages_(stages),
      accelerations_(StateLayout{data.n}.positions()),
      per_stage_(StageEquations::count(data)),
      mobility_(data.row_alpha.cwiseInverse()),
      epsilon_(kRelativeEpsilon * mobility_) {
  set_scales(data);
  find_joints(jacobian);
  if (BlockLu::takes(7 * stages)) make_blocks(data, jacobian);
  values_.resize(at(stages));
  P_.setZero(stages, stages);
  P2_.setZero(stages, stages);
  W_.setZero(data.m);
  right_.setZero(size(), kLanes);
  step_.setZero(size(), kLanes);
  v_.setZero(stages * accelerations_);
  q_.setZero(v_.size());
  probe_.setZero(size());
  answer_.setZero(size());
}

void StageMatrix::find_joints(const MotionJacobian& jacobian) {
  const auto& rows = jacobian.rows();
  for (std::size_t k = 0; k < rows.size();) {
    std::vector<int> bodies;
    const std::size_t first = k;
    for (; k < rows.size() && rows[k].row == rows[first].row; ++k) bodies.push_back(rows[k].body);
    if (!joints_.empty() && joints_.back().bodies == bodies &&
        joints_.back().row + joints_.back().rows == rows[first].row) {
      ++joints_.back().rows;
    } else {
      joints_.push_back({rows[first].row, 1, first, bodies, {}});
    }
  }
}

void StageMatrix::make_blocks(const MechanismData& data, const MotionJacobian& jacobian) {
  std::vector<std::pair<int, int>> edges;
  for (const auto& p : jacobian.pairs()) {
    if (p.row != p.body) edges.push_back({p.row, p.body});
  }
  for (const Joint& joint : joints_) {
    for (const int a : joint.bodies) {
      for (const int b : joint.bodies) {
        if (a != b) edges.push_back({a, b});
      }
    }
  }
  blocks_.emplace(7 * stages_, data.n, edges);
  for (const auto& p : jacobian.pairs()) pairs_.push_back(blocks_->handle(p.row, p.body));
  for (int b = 0; b < data.n; ++b) diagonal_.push_back(blocks_->handle(b, b));
  std::size_t most = 0;
  for (Joint& joint : joints_) {
    for (const int a : joint.bodies) {
      for (const int b : joint.bodies) joint.blocks.push_back(blocks_->handle(a, b));
    }
    most = std::max(most, at(joint.rows) * joint.bodies.size());
  }
  G_.resize(most);
  JW_.resize(most);
  by_body_.setZero(data.n * blocks_->stride());
}

// Lengths are in units of L and forces in units of J/L, where the heaviest body has the inertia J = m L^2. Multipliers
// are scaled so that the rows of G see J. Thus pivots are chosen among entries of one size, in micrometres as in
// kilometres. Powers of two round nothing.
void StageMatrix::set_scales(const MechanismData& data) {
  double mass = 0, inertia = 0;
  for (const BodyData& body : data.bodies) {
    mass = std::max(mass, body.mass);
    inertia = std::max(inertia, body.J.trace());
  }
  const auto power_of_two = [](double x) { return std::exp2(std::round(std::log2(x))); };
  const double J = inertia > 0 ? power_of_two(inertia) : 1, L = mass > 0 ? power_of_two(std::sqrt(J / mass)) : 1;
  const Vec<7> of_rows{{L, L, L, 1, 1, 1, J}}, of_columns{{L, L, L, 1, 1, 1, 1}};  // of a body
  scale_ = of_rows * of_columns.transpose();
  const Eigen::VectorXd of_multipliers = (data.row_alpha * J).cwiseSqrt().unaryExpr(power_of_two);
  row_scale_.resize(per_stage_);
  column_scale_.resize(per_stage_);
  row_scale_ << of_rows.replicate(data.n, 1), of_multipliers;
  column_scale_ << of_columns.replicate(data.n, 1), of_multipliers;
}

bool StageMatrix::factor(double h, const Eigen::MatrixXd& A, std::span<const MotionJacobian::Values> values,
                         Trial trial) {
  P_ = h * A;
  P2_.noalias() = P_.lazyProduct(P_);
  for (std::size_t i = 0; i < values_.size(); ++i) values_[i] = &values[values.size() == 1 ? 0 : i];
  W_ = (values_[0]->compliance + epsilon_.array()).inverse();
  ++factorisations_;
  use_sparse_ = false;
  if (blocks_ && sparse_left_ == 0) {
    tried_ = trial == Trial::now;
    if (factor_blocks() && (!tried_ || is_accurate())) return true;
    sparse_left_ = kSparseRun;
  }
  return turn_to_sparse();
}

bool StageMatrix::turn_to_sparse() {
  sparse_left_ = std::max(0, sparse_left_ - 1);
  use_sparse_ = tried_ = true;
  ++pivoted_;
  return factor_sparse();
}

bool StageMatrix::factor_blocks() {
  BlockLu& S = *blocks_;
  S.set_zero();
  for (int i = 0; i < stages_; ++i) {
    const MotionJacobian::Values& x = *values_[at(i)];
    for (int j = 0; j < stages_; ++j) {
      const double p = P_(i, j), pp = P2_(i, j);
      if (p != 0 || pp != 0) {
        for (std::size_t k = 0; k < pairs_.size(); ++k) {
          S.add(pairs_[k], 7 * i, 7 * j, scale_.cwiseProduct(p * x.v[k] + pp * x.q[k]));
        }
      }
      if (i == j) {
        for (std::size_t b = 0; b < diagonal_.size(); ++b) {
          S.add(diagonal_[b], 7 * i, 7 * i, scale_.cwiseProduct(x.mass[b]));
        }
      }
    }
    for (const Joint& joint : joints_) add_joint(joint, i, x);
  }
  return S.factor();
}

// J'W G of a joint's rows in the equations of stage i, scaled.
void StageMatrix::add_joint(const Joint& joint, int i, const MotionJacobian::Values& x) {
  const std::size_t bodies = joint.bodies.size(), rows = at(joint.rows), places = rows * bodies;
  const MotionJacobian::Row* const row_v = x.row_v.data() + joint.place;
  const MotionJacobian::Row* const row_q = x.row_q.data() + joint.place;
  const MotionJacobian::Row* const J_Z = x.J_Z.data() + joint.place;
  Vec<6>* const JW = JW_.data();
  MotionJacobian::Row* const G = G_.data();
  for (std::size_t k = 0; k < places; ++k) {
    const double W = W_(joint.row + static_cast<int>(k / bodies));
    JW[k] = W * row_scale_.head<6>().cwiseProduct(x.J[joint.place + k].transpose());
  }
  for (int j = 0; j < stages_; ++j) {
    const double p = P_(i, j), pp = P2_(i, j);
    if (i != j && p == 0 && pp == 0) continue;
    for (std::size_t k = 0; k < places; ++k) {
      G[k] = p * row_v[k] + pp * row_q[k];
      if (i == j) G[k] += J_Z[k];
      G[k].array() *= column_scale_.head<7>().transpose().array();
    }
    for (std::size_t a = 0; a < bodies; ++a) {
      for (std::size_t b = 0; b < bodies; ++b) {
        Mat<6, 7> JWG;
        for (int c = 0; c < 7; ++c) {
          Vec<6> column = G[b](c) * JW[a];
          for (std::size_t k = bodies; k < places; k += bodies) column += G[k + b](c) * JW[k + a];
          JWG.col(c) = column;
        }
        blocks_->add(joint.blocks[a * bodies + b], 7 * i, 7 * j, JWG);
      }
    }
  }
}

// f(row, column, value) for all entries of N with epsilon, scaled, always in the same order.
template <class Function>
void StageMatrix::for_each_entry(Function&& f) const {
  for (int i = 0; i < stages_; ++i) {
    const MotionJacobian::Values& of = *values_[at(i)];
    const auto add = [&](int stage, Eigen::Index row, Eigen::Index column, const auto& block) {
      for (Eigen::Index c = 0; c < block.cols(); ++c) {
        for (Eigen::Index r = 0; r < block.rows(); ++r) {
          f(i * per_stage_ + row + r, stage * per_stage_ + column + c,
            row_scale_(row + r) * column_scale_(column + c) * block(r, c));
        }
      }
    };
    for (int j = 0; j < stages_; ++j) {
      const double p = P_(i, j), pp = P2_(i, j);
      jacobian_->for_each_block(of, [&]<class Block>(int row, int column, const Block& q, const Block& v) {
        add(j, row, column, Block(p * v + pp * q));
      });
    }
    for (int b = 0; b < jacobian_->bodies(); ++b) add(i, columns_of(b), columns_of(b), of.mass[at(b)]);
    for (std::size_t k = 0; k < of.J.size(); ++k) {
      const auto& [row, body] = jacobian_->rows()[k];
      add(i, accelerations_ + row, columns_of(body), of.J_Z[k]);
      add(i, columns_of(body), accelerations_ + row, of.J[k].transpose());
    }
    for (int r = 0; r < jacobian_->constraints(); ++r) {
      add(i, accelerations_ + r, accelerations_ + r, Mat<1, 1>(-1 / W_(r)));
    }
  }
}

bool StageMatrix::factor_sparse() {
  if (!sparse_) {
    std::vector<SparseLu::Entry> places;
    for_each_entry([&](Eigen::Index row, Eigen::Index column, double) {
      places.push_back({static_cast<int>(row), static_cast<int>(column)});
    });
    sparse_.emplace(static_cast<int>(size()), places);
  }
  std::vector<double>& x = sparse_->values();
  std::fill(x.begin(), x.end(), 0.0);
  std::size_t k = 0;
  for_each_entry([&](Eigen::Index, Eigen::Index, double value) { x[sparse_->slot(k++)] += value; });
  return sparse_->factor();
}

// Tries the factor on the forces of alternating accelerations of 1, with constraints. The residual of the answer must
// be small against the largest force in it.
bool StageMatrix::is_accurate() {
  answer_.setZero();
  probe_.setZero();
  double largest = 0;
  for (int i = 0; i < stages_; ++i) {
    for (int b = 0; b < jacobian_->bodies(); ++b) {
      answer_.segment<7>(i * per_stage_ + columns_of(b)).setConstant(b % 2 == 0 ? -1 : 1);
    }
  }
  subtract_times<false>(answer_, probe_);
  for (int i = 0; i < stages_; ++i) {
    probe_.segment(i * per_stage_ + accelerations_, W_.size()).setZero();
    largest = std::max(largest, probe_.segment(i * per_stage_, accelerations_).cwiseAbs().maxCoeff());
  }
  answer_ = probe_;
  solve_factored<false>(answer_);
  subtract_times<false>(answer_, probe_);
  double wrong = 0;
  for (int i = 0; i < stages_; ++i) {
    for (int b = 0; b < jacobian_->bodies(); ++b) {
      wrong = std::max(wrong, probe_.segment<6>(i * per_stage_ + columns_of(b)).cwiseAbs().maxCoeff());
    }
  }
  if (!answer_.allFinite()) return false;
  probe_.setZero();
  add_J_transposed(1, answer_, probe_);
  for (int i = 0; i < stages_; ++i) {
    largest = std::max(largest, probe_.segment(i * per_stage_, accelerations_).cwiseAbs().maxCoeff());
  }
  return wrong <= kWrong * largest;
}

// x += N_epsilon^-1 (b - N x)  until the next step, foreseen from the last two, would be negligible in each column.
// Accelerations and multipliers contract alike; where one of them seems slower, it is at rounding.
template <bool Transposed>
void StageMatrix::refine(Eigen::Ref<Eigen::MatrixXd> b, int refinements) {
  if (refinements == 0) {
    solve_factored<Transposed>(b);
    return;
  }
  auto right = right_.leftCols(b.cols()), step = step_.leftCols(b.cols());
  right = b;
  solve_factored<Transposed>(b);
  const Sizes size = sizes(b);
  Sizes before = size;
  for (int pass = 0; pass < refinements; ++pass) {
    step = right;
    for (Eigen::Index c = 0; c < b.cols(); ++c) subtract_times<Transposed>(b.col(c), step.col(c));
    solve_factored<Transposed>(step);
    b += step;
    const Sizes now = sizes(step);
    const Sizes rates = (before > 0).select(now / before, 1.0);
    if ((rates.colwise().minCoeff() * now.colwise().maxCoeff() <= kNegligible * size.colwise().maxCoeff()).all()) {
      tried_ = true;
      return;
    }
    before = now;
  }
  if (tried_ || refinements < kExact) return;
  b = right;
  sparse_left_ = kSparseRun;
  if (turn_to_sparse()) return refine<Transposed>(b, refinements);
  b.setConstant(NAN);
}

StageMatrix::Sizes StageMatrix::sizes(const Eigen::Ref<const Eigen::MatrixXd>& x) const {
  Sizes most = Sizes::Zero();
  const Eigen::Index m = W_.size();
  for (int i = 0; i < stages_; ++i) {
    const auto of_stage = x.middleRows(i * per_stage_, per_stage_);
    for (Eigen::Index c = 0; c < x.cols(); ++c) {
      most(0, c) = std::max(most(0, c), of_stage.col(c).head(accelerations_).cwiseAbs().maxCoeff());
      if (m > 0)
        most(1, c) = std::max(most(1, c), of_stage.col(c).tail(m).cwiseProduct(mobility_).cwiseAbs().maxCoeff());
    }
  }
  return most;
}

template <bool Transposed>
void StageMatrix::solve_factored(Eigen::Ref<Eigen::MatrixXd> b) {
  if (!use_sparse_) {
    for (Eigen::Index c = 0; c < b.cols(); ++c) solve_blocks<Transposed>(b.col(c));
  } else {
    scale<Transposed>(b);
    if (Transposed) {
      sparse_->solve_transposed(b);
    } else {
      sparse_->solve(b);
    }
    scale<!Transposed>(b);
  }
}

// Right-hand sides of the scaled matrix, from those of N; with Columns, solutions of N from its solutions (of N', from
// right-hand sides).
template <bool Columns>
void StageMatrix::scale(Eigen::Ref<Eigen::MatrixXd> b) const {
  for (int i = 0; i < stages_; ++i) {
    b.middleRows(i * per_stage_, per_stage_).array().colwise() *= (Columns ? column_scale_ : row_scale_).array();
  }
}

// a = S^-1 (b_a + J'W b_lambda),  lambda = W (G a - b_lambda);  transposed with J and G exchanged.
template <bool Transposed>
void StageMatrix::solve_blocks(Eigen::Ref<Eigen::VectorXd> b) {
  for (int i = 0; i < stages_; ++i) b.segment(i * per_stage_ + accelerations_, W_.size()).array() *= W_.array();
  if (Transposed) {
    add_G_transposed(1, b, b);
  } else {
    add_J_transposed(1, b, b);
  }
  const Eigen::Index stride = blocks_->stride();
  for (int i = 0; i < stages_; ++i) {
    for (int body = 0; body < jacobian_->bodies(); ++body) {
      by_body_.segment<7>(body * stride + 7 * i) = (Transposed ? column_scale_ : row_scale_)
                                                       .head<7>()
                                                       .cwiseProduct(b.segment<7>(i * per_stage_ + columns_of(body)));
    }
  }
  if (Transposed) {
    blocks_->solve_transposed(by_body_);
  } else {
    blocks_->solve(by_body_);
  }
  for (int i = 0; i < stages_; ++i) {
    for (int body = 0; body < jacobian_->bodies(); ++body) {
      b.segment<7>(i * per_stage_ + columns_of(body)) =
          (Transposed ? row_scale_ : column_scale_).head<7>().cwiseProduct(by_body_.segment<7>(body * stride + 7 * i));
    }
    auto lambda = b.segment(i * per_stage_ + accelerations_, W_.size());
    lambda.array() /= -W_.array();
  }
  if (Transposed) {
    add_J(1, b, b);
  } else {
    add_G(1, b, b);
  }
  for (int i = 0; i < stages_; ++i) b.segment(i * per_stage_ + accelerations_, W_.size()).array() *= W_.array();
}

template <bool Transposed>
void StageMatrix::subtract_times(const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) {
  if (Transposed) {
    v_.setZero();
    q_.setZero();
  } else {
    add_G(-1, x, y);  // leaves x combined
  }
  for (int i = 0; i < stages_; ++i) {
    const MotionJacobian::Values& of = *values_[at(i)];
    const Eigen::Index stage = i * per_stage_, combined = i * accelerations_;
    for (std::size_t k = 0; k < jacobian_->pairs().size(); ++k) {
      const auto& p = jacobian_->pairs()[k];
      auto v = v_.segment<7>(combined + columns_of(p.body)), q = q_.segment<7>(combined + columns_of(p.body));
      if (Transposed) {
        const Vec<7> beta = x.segment<7>(stage + columns_of(p.row));
        v.noalias() += of.v[k].transpose() * beta;
        q.noalias() += of.q[k].transpose() * beta;
      } else {
        auto to = y.segment<7>(stage + columns_of(p.row));
        to.noalias() -= of.v[k] * v;
        to.noalias() -= of.q[k] * q;
      }
    }
    for (int b = 0; b < jacobian_->bodies(); ++b) {
      auto to = y.segment<7>(stage + columns_of(b));
      const auto a = x.segment<7>(stage + columns_of(b));
      if (Transposed) {
        to.noalias() -= of.mass[at(b)].transpose() * a;
      } else {
        to.noalias() -= of.mass[at(b)] * a;
      }
    }
    y.segment(stage + accelerations_, W_.size()) += of.compliance * x.segment(stage + accelerations_, W_.size());
  }
  if (Transposed) {
    spread(-1, y);
    add_G_transposed(-1, x, y);
    add_J(-1, x, y);
  } else {
    add_J_transposed(-1, x, y);
  }
}

// v_i = sum_j P_ij a_j,  q_i = sum_j (P^2)_ij a_j
void StageMatrix::combine(const Eigen::Ref<const Eigen::VectorXd>& x) {
  v_.setZero();
  q_.setZero();
  for (int i = 0; i < stages_; ++i) {
    for (int j = 0; j < stages_; ++j) {
      const auto a = x.segment(j * per_stage_, accelerations_);
      v_.segment(i * accelerations_, accelerations_) += P_(i, j) * a;
      q_.segment(i * accelerations_, accelerations_) += P2_(i, j) * a;
    }
  }
}

// a_j of y += sign (sum_i P_ij v_i + (P^2)_ij q_i)
void StageMatrix::spread(double sign, Eigen::Ref<Eigen::VectorXd> y) {
  for (int i = 0; i < stages_; ++i) {
    for (int j = 0; j < stages_; ++j) {
      y.segment(j * per_stage_, accelerations_) += (sign * P_(i, j)) * v_.segment(i * accelerations_, accelerations_) +
                                                   (sign * P2_(i, j)) * q_.segment(i * accelerations_, accelerations_);
    }
  }
}

// f(values, k, row, body, combined) for each row of Phi and body that it ties, element k of the Jacobian's rows, in
// each stage: the places of its multiplier, of the body's accelerations, and of these in v_ and q_.
template <class Function>
void StageMatrix::for_each_row(Function&& f) const {
  for (int i = 0; i < stages_; ++i) {
    for (std::size_t k = 0; k < jacobian_->rows().size(); ++k) {
      const auto& r = jacobian_->rows()[k];
      f(*values_[at(i)], k, i * per_stage_ + accelerations_ + r.row, i * per_stage_ + columns_of(r.body),
        i * accelerations_ + columns_of(r.body));
    }
  }
}

void StageMatrix::add_G(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) {
  combine(x);
  for_each_row([&](const auto& of, auto k, auto row, auto body, auto combined) {
    y(row) += sign * (of.row_v[k].dot(v_.segment<7>(combined)) + of.row_q[k].dot(q_.segment<7>(combined)) +
                      of.J_Z[k].dot(x.segment<7>(body)));
  });
}

void StageMatrix::add_G_transposed(double sign, const Eigen::Ref<const Eigen::VectorXd>& x,
                                   Eigen::Ref<Eigen::VectorXd> y) {
  v_.setZero();
  q_.setZero();
  for_each_row([&](const auto& of, auto k, auto row, auto body, auto combined) {
    const double lambda = x(row);
    v_.segment<7>(combined) += lambda * of.row_v[k].transpose();
    q_.segment<7>(combined) += lambda * of.row_q[k].transpose();
    y.segment<7>(body) += (sign * lambda) * of.J_Z[k].transpose();
  });
  spread(sign, y);
}

void StageMatrix::add_J(double sign, const Eigen::Ref<const Eigen::VectorXd>& x, Eigen::Ref<Eigen::VectorXd> y) {
  for_each_row(
      [&](const auto& of, auto k, auto row, auto body, auto) { y(row) += sign * of.J[k].dot(x.segment<6>(body)); });
}

void StageMatrix::add_J_transposed(double sign, const Eigen::Ref<const Eigen::VectorXd>& x,
                                   Eigen::Ref<Eigen::VectorXd> y) {
  for_each_row([&](const auto& of, auto k, auto row, auto body, auto) {
    y.segment<6>(body) += (sign * x(row)) * of.J[k].transpose();
  });
}

template void StageMatrix::refine<false>(Eigen::Ref<Eigen::MatrixXd>, int);
template void StageMatrix::refine<true>(Eigen::Ref<Eigen::MatrixXd>, int);

}  // namespace mbsopt
