#include "core/dynamics/motion_jacobian.hpp"

namespace mbsopt {

MotionJacobian::MotionJacobian(const MechanismData& data) : n_(data.n), m_(data.m) {
  const MotionBlocks pattern(data);
  pairs_ = pattern.pairs();
  rows_ = pattern.rows();
  for (const Place& place : rows_) {
    std::vector<int> blocks;
    for (const RowGroup& g : data.groups) {
      if (place.row < g.row || place.row >= g.row + g.rows) continue;
      if (g.body1 == place.body + 1) blocks.push_back(g.block + place.row - g.row);
      if (g.body2 == place.body + 1) blocks.push_back(-1 - (g.block + place.row - g.row));
    }
    blocks_of_.push_back(blocks);
  }
  omegadot_p_.resize(at(n_));
}

MotionJacobian::Values MotionJacobian::values() const {
  Values x;
  x.q.assign(pairs_.size(), Block::Zero());
  x.v = x.q;
  x.row_q.assign(rows_.size(), Row::Zero());
  x.row_v = x.row_q;
  x.J_Z = x.row_q;
  x.J.assign(rows_.size(), Mat<1, 6>::Zero());
  x.mass.assign(at(n_), Block::Zero());
  return x;
}

void MotionJacobian::evaluate(StageEquations& equations, Values& out) {
  const MotionBlocks& blocks = equations.blocks();
  for (int i = 0; i < n_; ++i) {
    out.mass[at(i)] = equations.mass_block(i + 1);
    omegadot_p_[at(i)] = equations.omegadot_by_p(i + 1);
  }
  const ConstraintRows& J = equations.rows();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const int body = rows_[k].body;
    out.J[k].setZero();
    for (const int block : blocks_of_[k]) out.J[k] += block >= 0 ? J.J1.row(block) : J.J2.row(-1 - block);
    out.J_Z[k] = equations.times_Z(body + 1, out.J[k]);
    out.row_q[k] = -blocks.c[k].q;
    out.row_q[k].tail<4>() += out.J[k].tail<3>() * omegadot_p_[at(body)];
    out.row_v[k] = -blocks.c[k].v;
  }
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    out.q[k].topRows<6>() = -blocks.b[k].q;
    out.v[k].topRows<6>() = -blocks.b[k].v;
    if (pairs_[k].row == pairs_[k].body) equations.add_fixed_a(pairs_[k].row + 1, out.q[k], out.v[k]);
  }
  out.compliance = equations.compliance();
}

}  // namespace mbsopt
