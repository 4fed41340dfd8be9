// Finds the rows of a sparse Jacobian that are independent of the rows before them, and the directions that no row
// reaches. The cost is linear in the number of bodies if few of them couple at a time: chains, trees, rows of loops.
//
// The columns of one body after another are eliminated (multifrontal, order of elimination.hpp). At a body, the rows
// that touch it are taken in their order. A row is a pivot row if its part in the body's columns is independent of that
// of the rows before it. The other rows are reduced by the pivot rows before them, lose the body's columns and move on
// to the next body.
//
// This finds the same rows as Gram-Schmidt on whole rows. A pivot row is independent of all rows before it, since part
// of it is. Another row is reduced by the pivot rows before it. It is independent of the reduced rows before it if and
// only if the row itself is independent (contraction of a matroid: Oxley, "Matroid Theory" (2011), section 3.1). A row
// that depends on earlier ones at its own front alone is dropped there. So no front passes on more rows than columns.
//
// A pivot row with a small part magnifies rounding, as of axes that are parallel but for 1e-8. Then all bodies form one
// front, if they are few.
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

// Takes rows in their order, scaled to unit length. A row is dependent if less than `threshold` of it remains. Each
// body has `width` columns, one body after another. Entries of one place add up.
RowDependence row_dependence(int rows, int bodies, int width, std::span<const SparseEntry> J, double threshold);

}  // namespace mbsopt
