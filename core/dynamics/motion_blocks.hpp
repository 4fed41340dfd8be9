// Holds the derivatives of the equations of motion in the state, as blocks on the graph of bodies. z = (rddot,
// omegadot) and lambda stay fixed:
//
//   b = f - M z - J'lambda      one 6 x 14 block per body and body that its equations read
//   c = -(Phiddot + 2 xi omega Phidot + omega^2 Phi)      one 1 x 14 block per row of Phi and body that it ties
//
// Columns are a body's q = (r, p) and v = (rdot, pdot). Most blocks are empty but for some of r, p, rdot, pdot;
// products skip the rest. Evaluated once per state, they serve every tangent direction there and the matrices of
// implicit methods.
#pragma once

#include <vector>

#include "core/linear/block_kernels.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/mechanism/parameter_lanes.hpp"

namespace mbsopt {

class MotionBlocks {
 public:
  enum Part { r = 1, p = 2, rdot = 4, pdot = 8 };
  using Place = MotionPlace;  // the equations' body (0-based) or row of Phi; the body whose coordinates (0-based)
  template <int Rows>
  struct Block {
    Mat<Rows, 7> q = Mat<Rows, 7>::Zero(), v = Mat<Rows, 7>::Zero();
    int parts = 0;  // that are not empty; what was filled once counts as filled

    // Adds columns of a part; those of r and rdot may come with a fourth one, which must be zero.
    template <class Columns>
    void add(Part part, const Columns& x) {
      Mat<Rows, 7>& half = part == r || part == p ? q : v;
      half.template middleCols<4>(part == r || part == rdot ? 0 : 3) += x;
      parts |= part;
    }
  };

  explicit MotionBlocks(const MechanismData& data);

  // By equations' body or row, then by body.
  const std::vector<Place>& pairs() const { return pairs_; }
  const std::vector<Place>& rows() const { return rows_; }
  int pair(int row, int body) const { return find(pairs_, pair_begin_, row, body); }  // its index
  int row(int row, int body) const { return find(rows_, row_begin_, row, body); }

  std::vector<Block<6>> b;  // per pair
  std::vector<Block<1>> c;  // per row and body

  void set_zero();
  // b_dir += b y_dir, one entry per moving body; c_dir += c y_dir.   y_dir: 14 n directions of (q, v)
  void add_times(const LaneRows& y_dir, std::vector<Lanes<6>>& b_dir, LaneRows& c_dir) const;

 private:
  static int find(const std::vector<Place>& places, const std::vector<int>& begin, int row, int body);

  int n_;
  std::vector<Place> pairs_, rows_;
  std::vector<int> pair_begin_, row_begin_;
};

}  // namespace mbsopt
