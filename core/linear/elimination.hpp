// Symbolic elimination of a matrix of blocks on the graph of bodies: order (approximate minimum degree), fill, and the
// blocks that each column updates. Both block factorisations follow it.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace mbsopt {

struct Elimination {
  struct Entry {  // a block of column k below the diagonal: its row (elimination position), its body, its place
    int row = 0, body = 0;
    std::size_t block = 0;
  };
  // The elimination of column k changes `target` by the product of its entries i and j (their numbers in the column), i
  // at or below j. For a diagonal block i = j, and target is an elimination position.
  struct Update {
    std::size_t target = 0, i = 0, j = 0;
    bool diagonal = false;
  };
  struct Place {  // of the block (row, column) of an edge; transposed: that of (column, row) is the one stored
    std::size_t block = 0;
    bool transposed = false;
  };

  Elimination() = default;
  // Bodies are 0..bodies-1. edges lists pairs of bodies that share a block, in any order, repeated or not.
  Elimination(int bodies, std::span<const std::pair<int, int>> edges);

  int bodies() const { return static_cast<int>(order.size()); }
  Place place(int row, int column) const;  // of an edge

  std::vector<int> position, order;  // body -> elimination position and back
  std::vector<std::vector<Entry>> columns;
  std::vector<std::vector<Update>> updates;
  std::size_t blocks = 0;  // below the diagonal
};

}  // namespace mbsopt
