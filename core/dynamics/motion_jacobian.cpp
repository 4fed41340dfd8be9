#include "core/dynamics/motion_jacobian.hpp"

#include <algorithm>

#include "core/mechanism/coupling.hpp"

namespace mbsopt {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

// Greedy colouring of bodies; two that the equations of one body read differ.
std::vector<int> colour(const Coupling& coupled) {
  std::vector<std::vector<int>> readers(coupled.bodies.size());
  for (std::size_t i = 0; i < coupled.bodies.size(); ++i) {
    for (const int j : coupled.bodies[i]) readers[at(j - 1)].push_back(static_cast<int>(i));
  }
  std::vector<int> colours(coupled.bodies.size(), -1);
  std::vector<bool> taken;
  for (std::size_t j = 0; j < colours.size(); ++j) {
    taken.assign(colours.size() + 1, false);
    for (const int i : readers[j]) {
      for (const int k : coupled.bodies[at(i)]) {
        if (colours[at(k - 1)] >= 0) taken[at(colours[at(k - 1)])] = true;
      }
    }
    colours[j] = static_cast<int>(std::find(taken.begin(), taken.end(), false) - taken.begin());
  }
  return colours;
}

}  // namespace

MotionJacobian::MotionJacobian(const MechanismData& data) : n_(data.n), m_(data.m) {
  const Coupling coupled = coupling(data);
  colour_ = colour(coupled);
  for (const int c : colour_) colours_ = std::max(colours_, c + 1);
  pairs_of_.resize(at(colours_));
  rows_of_.resize(at(colours_));
  for (int i = 0; i < n_; ++i) {
    for (const int j : coupled.bodies[at(i)]) {
      pairs_of_[at(colour_[at(j - 1)])].push_back(static_cast<int>(pairs_.size()));
      pairs_.push_back({i, j - 1});
    }
  }
  for (int r = 0; r < m_; ++r) {
    for (const int j : coupled.rows[at(r)]) {
      rows_of_[at(colour_[at(j - 1)])].push_back(static_cast<int>(rows_.size()));
      rows_.push_back({r, j - 1});
      std::vector<int> blocks;
      for (const RowGroup& g : data.groups) {
        if (r < g.row || r >= g.row + g.rows) continue;
        if (g.body1 == j) blocks.push_back(g.block + r - g.row);
        if (g.body2 == j) blocks.push_back(-1 - (g.block + r - g.row));
      }
      blocks_of_.push_back(blocks);
    }
  }
  none_.theta.setZero(data.slots(), kLanes);
  std::fill(std::begin(none_.parameter), std::end(none_.parameter), -1);
  y_dir_.setZero(14 * n_, kLanes);
  r_dir_.setZero(7 * n_ + m_, kLanes);
}

MotionJacobian::Values MotionJacobian::values() const {
  Values x;
  x.q.assign(pairs_.size(), Block::Zero()), x.v = x.q;
  x.row_q.assign(rows_.size(), Row::Zero()), x.row_v = x.row_q, x.J_T = x.row_q;
  x.J.assign(rows_.size(), Mat<1, 6>::Zero());
  x.mass.assign(at(n_), Block::Zero());
  return x;
}

void MotionJacobian::evaluate(Dynamics& dynamics, Values& out) {
  const int directions = 14 * colours_;
  auto component = [&](int direction) { return direction % 14; };
  auto row_of = [&](int body, int c) { return (c < 7 ? 0 : 7 * n_) + 7 * body + c % 7; };
  for (int first = 0; first < directions; first += kLanes) {
    y_dir_.setZero();
    for (int lane = 0; lane < kLanes && first + lane < directions; ++lane) {
      for (int j = 0; j < n_; ++j) {
        if (colour_[at(j)] == (first + lane) / 14) y_dir_(row_of(j, component(first + lane)), lane) = 1;
      }
    }
    dynamics.residual_tangent(none_, y_dir_, r_dir_);
    for (int lane = 0; lane < kLanes && first + lane < directions; ++lane) {
      const int c = component(first + lane);
      const std::size_t colour = at((first + lane) / 14);
      for (const int k : pairs_of_[colour]) {
        (c < 7 ? out.q : out.v)[at(k)].col(c % 7) = -r_dir_.block<7, 1>(7 * pairs_[at(k)].row, lane);
      }
      for (const int k : rows_of_[colour]) {
        (c < 7 ? out.row_q : out.row_v)[at(k)](c % 7) = -r_dir_(7 * n_ + rows_[at(k)].row, lane);
      }
    }
  }
  for (int i = 0; i < n_; ++i) out.mass[at(i)] = dynamics.mass_block(i + 1);
  const ConstraintRows& J = dynamics.place_rows();
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    out.J[k].setZero();
    for (const int block : blocks_of_[k]) out.J[k] += block >= 0 ? J.J1.row(block) : J.J2.row(-1 - block);
    out.J_T[k] = dynamics.times_T(rows_[k].body + 1, out.J[k]);
  }
  out.compliance = dynamics.compliance();
}

}  // namespace mbsopt
