#include "core/dynamics/motion_blocks.hpp"

#include <cassert>
#include <cstddef>

#include "core/linear/kernel_table.hpp"
#include "core/mechanism/coupling.hpp"

namespace mbsopt {
namespace {

void list(const std::vector<std::vector<int>>& bodies, std::vector<MotionBlocks::Place>& places,
          std::vector<int>& begin) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    begin.push_back(static_cast<int>(places.size()));
    for (const int body : bodies[i]) places.push_back({static_cast<int>(i), body - 1});
  }
  begin.push_back(static_cast<int>(places.size()));
}

// The blocks in the form of kernel_table.hpp.
template <int Rows>
const MotionBlockView<Rows>* view(const std::vector<MotionBlocks::Block<Rows>>& blocks) {
  using Ours = MotionBlocks::Block<Rows>;
  using Theirs = MotionBlockView<Rows>;
  static_assert(sizeof(Ours) == sizeof(Theirs) && alignof(Ours) >= alignof(Theirs) &&
                offsetof(Ours, v) == offsetof(Theirs, v) && offsetof(Ours, parts) == offsetof(Theirs, parts));
  return reinterpret_cast<const Theirs*>(blocks.data());
}

}  // namespace

MotionBlocks::MotionBlocks(const MechanismData& data) : n_(data.n) {
  const Coupling coupled = coupling(data);
  list(coupled.bodies, pairs_, pair_begin_);
  list(coupled.rows, rows_, row_begin_);
  b.resize(pairs_.size());
  c.resize(rows_.size());
}

int MotionBlocks::find(const std::vector<Place>& places, const std::vector<int>& begin, int row, int body) {
  int low = begin[at(row)], high = begin[at(row) + 1] - 1;
  while (low < high) {
    const int middle = (low + high) / 2;
    if (places[at(middle)].body < body) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  assert(low < begin[at(row) + 1] && places[at(low)].body == body);  // uncoupled bodies (coupling.hpp) have no block
  return low;
}

void MotionBlocks::set_zero() {
  for (Block<6>& x : b) {
    x.q.setZero();
    x.v.setZero();
  }
  for (Block<1>& x : c) {
    x.q.setZero();
    x.v.setZero();
  }
}

void MotionBlocks::add_times(const LaneRows& y_dir, std::vector<Lanes<6>>& b_dir, LaneRows& c_dir) const {
  const BlockKernels& kernels = block_kernels();
  const std::size_t n = at(n_);
  if (n > 0)
    kernels.add_motion_of_bodies(view(b), pairs_.data(), pair_begin_.data(), n, n, y_dir.data(), b_dir[0].data());
  kernels.add_motion_of_rows(view(c), rows_.data(), row_begin_.data(), row_begin_.size() - 1, n, y_dir.data(),
                             c_dir.data());
}

}  // namespace mbsopt
