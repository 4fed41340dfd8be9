// The derivatives of the equations of motion (StageEquations) in (q, v, a, lambda) as blocks on the graph of bodies.
//
//   -r_q, -r_v:  one 7x7 block per coupled pair of bodies, one 1x7 block per row of Phi and body that it ties
//   -r_a:        one 7x7 block per body (M T), one 1x7 block per row and body (J T);   -r_lambda: J', -1/alpha
//
// MotionBlocks gives r_q and r_v with z fixed. A fixed a adds the terms of omegadot' in stage_equations.hpp.
#pragma once

#include <vector>

#include "core/dynamics/stage_equations.hpp"

namespace mbsopt {

// The first column of a body, counted from 0 as in MotionBlocks::Place, in q, v or a.
inline int columns_of(int body) { return 7 * body; }

class MotionJacobian {
 public:
  using Block = Mat<7, 7>;
  using Row = Mat<1, 7>;
  using Place = MotionBlocks::Place;

  struct Values {
    std::vector<Block> q, v;        // per pair of bodies
    std::vector<Row> row_q, row_v;  // per row and body
    std::vector<Block> mass;        // per body
    std::vector<Row> J_Z;           // per row and body
    std::vector<Mat<1, 6>> J;       // per row and body
    double compliance = 0;          // of every row
  };

  explicit MotionJacobian(const MechanismData& data);

  const std::vector<Place>& pairs() const { return pairs_; }
  const std::vector<Place>& rows() const { return rows_; }
  int bodies() const { return n_; }
  int constraints() const { return m_; }
  Values values() const;  // of the right sizes
  // f(row, column, q, v) for the blocks of -r_q and -r_v: where they begin in the equations of a stage, and in q and v.
  template <class Function>
  void for_each_block(const Values& x, Function&& f) const {
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      f(columns_of(pairs_[k].row), columns_of(pairs_[k].body), x.q[k], x.v[k]);
    for (std::size_t k = 0; k < rows_.size(); ++k)
      f(columns_of(n_) + rows_[k].row, columns_of(rows_[k].body), x.row_q[k], x.row_v[k]);
  }

  // Evaluates them at the current state of the equations.
  void evaluate(StageEquations& equations, Values& out);

 private:
  int n_, m_;
  std::vector<Place> pairs_, rows_;
  std::vector<std::vector<int>>
      blocks_of_;                      // per element of rows_: its blocks of ConstraintRows; negative: -1 - block of J2
  std::vector<Mat<3, 4>> omegadot_p_;  // per body
};

}  // namespace mbsopt
