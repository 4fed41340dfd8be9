// The derivatives of the equations of motion (Dynamics::residual) in (q, v, a, lambda) as blocks on the graph of
// bodies.
//
//   -r_q, -r_v:  one 7x7 block per coupled pair of bodies, one 1x7 block per row of Phi and body that it ties
//   -r_a:        one 7x7 block per body (M T), one 1x7 block per row and body (J T);   -r_lambda: J', -1/alpha
//
// Columns come from tangents, several bodies at once: bodies that no common equation reads share a colour, and all
// bodies of a colour are perturbed together (Curtis, Powell, Reid, "On the estimation of sparse Jacobian matrices", J.
// Inst. Maths Applics 13 (1974); exact here, no difference is taken).
#pragma once

#include <vector>

#include "core/dynamics/dynamics.hpp"

namespace mbsopt {

class MotionJacobian {
 public:
  using Block = Mat<7, 7>;
  using Row = Mat<1, 7>;

  struct Values {
    std::vector<Block> q, v;        // per pair of bodies
    std::vector<Row> row_q, row_v;  // per row and body
    std::vector<Block> mass;        // per body
    std::vector<Row> J_T;           // per row and body
    std::vector<Mat<1, 6>> J;       // the same
    double compliance = 0;          // of every row
  };
  struct Place {
    int row, body;  // the equation's body (0-based) or row of Phi; the body whose coordinates (0-based)
  };

  explicit MotionJacobian(const MechanismData& data);

  const std::vector<Place>& pairs() const { return pairs_; }
  const std::vector<Place>& rows() const { return rows_; }
  int bodies() const { return n_; }
  int constraints() const { return m_; }
  int colours() const { return colours_; }
  Values values() const;  // of the right sizes

  // At the place where `dynamics` is (place_at).
  void evaluate(Dynamics& dynamics, Values& out);

 private:
  int n_, m_, colours_ = 0;
  std::vector<Place> pairs_, rows_;
  std::vector<int> colour_;                 // per body
  std::vector<std::vector<int>> pairs_of_;  // per colour: indices into pairs_
  std::vector<std::vector<int>> rows_of_;   // per colour: indices into rows_
  std::vector<std::vector<int>>
      blocks_of_;  // per element of rows_: its blocks of ConstraintRows; negative: -1 - block of J2
  ParameterBlock none_;
  LaneRows y_dir_, r_dir_;
};

}  // namespace mbsopt
