// Which rows of a sparse Jacobian are independent of the rows before them, and which directions no row reaches. The
// cost is linear in the number of bodies where few of them hang together at a time: chains, trees, rows of loops.
//
// The columns of one body after another are eliminated (multifrontal, order of elimination.hpp). At a body, the rows
// that touch it are taken in their order; a row whose part in the body's columns is independent of that of the rows
// before is a pivot row. The others are reduced by pivot rows before them, lose the body's columns and move on to the
// next body.
//
// This finds the same rows as Gram-Schmidt on whole rows. A pivot row is independent of all rows before it, since part
// of it is. What pivot rows before it leave of another row is independent of the reduced rows before it if and only if
// the row itself is independent (contraction of a matroid: Oxley, "Matroid Theory" (2011), section 3.1). A row that
// depends on earlier ones at its own front alone is dropped there, so that no front has more rows than columns to pass
// on.
#pragma once

#include <span>
#include <vector>

#include "core/linear/sparse_projection.hpp"

namespace mbsopt {

struct RowDependence {
  struct Direction {
    int body = 0, column = 0;  // the column with most of it, within those of the body
  };
  std::vector<bool> independent;  // per row
  int rank = 0;
  std::vector<Direction> unreached;  // one per missing rank of the columns
};

// Rows are taken in their order, scaled to unit length; one counts as dependent where less than `threshold` of it is
// left. Each body has `width` columns, one body after another. Entries of one place add up.
RowDependence row_dependence(int rows, int bodies, int width, std::span<const SparseEntry> J, double threshold);

}  // namespace mbsopt
