// Derivatives of the right-hand sides of the equations of motion in the state, as blocks on the graph of bodies. z =
// (rddot, omegadot) and lambda are held fixed:
//
//   b = f - M z - J'lambda      one 6 x 14 block per body and body that its equations read
//   c = -(Phiddot + 2 xi omega Phidot + omega^2 Phi)      one 1 x 14 block per row of Phi and body that it ties
//
// Columns are a body's q = (r, p) and v = (rdot, pdot). Most blocks depend on some of r, p, rdot, pdot only, and
// products skip the rest. The blocks are evaluated once per state. They serve every tangent direction there and the
// matrices of implicit methods.
#pragma once

#include <vector>

#include "core/linear/kernel_table.hpp"
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
    int parts = 0;  // those that add() has filled

    // Adds the columns of a part. r and rdot may come with a fourth column, which must be zero.
    template <class Columns>
    void add(Part part, const Columns& x) {
      Mat<Rows, 7>& half = part == r || part == p ? q : v;
      half.template middleCols<4>(part == r || part == rdot ? 0 : 3) += x;
      parts |= part;
    }
  };

  explicit MotionBlocks(const MechanismData& data);

  // Both are sorted by the body of the equations (or the row), then by body.
  const std::vector<Place>& pairs() const { return pairs_; }
  const std::vector<Place>& rows() const { return rows_; }
  // The index of the block of two bodies, the ground being 0: of the equations of one in the coordinates of the other.
  int pair(int loaded, int read) const { return find(pairs_, pair_begin_, loaded - 1, read - 1); }
  int row(int row, int read) const { return find(rows_, row_begin_, row, read - 1); }

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
