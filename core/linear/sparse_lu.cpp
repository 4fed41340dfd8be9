#include "core/linear/sparse_lu.hpp"

#include <klu.h>

#include <algorithm>
#include <new>
#include <numeric>

namespace mbsopt {
namespace {

// Pivots of an earlier matrix are kept while the reciprocal growth of the factors stays above this.
constexpr double kLeastGrowth = 1e-6;

}  // namespace

struct SparseLu::Klu {
  klu_common common;
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;
  std::vector<int> starts, rows;

  ~Klu() {
    klu_free_numeric(&numeric, &common);
    klu_free_symbolic(&symbolic, &common);
  }
  int size() const { return static_cast<int>(starts.size()) - 1; }
};

SparseLu::SparseLu(int size, const std::vector<Entry>& entries)
    : klu_(std::make_unique<Klu>()), slots_(entries.size()) {
  std::vector<std::size_t> order(entries.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(entries[a].column, entries[a].row) < std::pair(entries[b].column, entries[b].row);
  });
  klu_->starts.assign(static_cast<std::size_t>(size) + 1, 0);
  int column = -1;
  for (const std::size_t k : order) {
    const Entry& e = entries[k];
    if (e.column != column || e.row != klu_->rows.back()) {
      klu_->rows.push_back(e.row);
      ++klu_->starts[static_cast<std::size_t>(e.column) + 1];
      column = e.column;
    }
    slots_[k] = klu_->rows.size() - 1;
  }
  std::partial_sum(klu_->starts.begin(), klu_->starts.end(), klu_->starts.begin());
  values_.assign(klu_->rows.size(), 0.0);
  klu_defaults(&klu_->common);
  if (size == 0) return;
  klu_->symbolic = klu_analyze(size, klu_->starts.data(), klu_->rows.data(), &klu_->common);
  if (!klu_->symbolic) throw std::bad_alloc();
}

SparseLu::~SparseLu() = default;
SparseLu::SparseLu(SparseLu&&) noexcept = default;
SparseLu& SparseLu::operator=(SparseLu&&) noexcept = default;

int SparseLu::size() const { return klu_->size(); }

bool SparseLu::factor() {
  Klu& k = *klu_;
  if (k.size() == 0) return true;
  if (!std::all_of(values_.begin(), values_.end(), [](double x) { return x - x == 0; })) return false;
  if (k.numeric) {
    const bool refactored =
        klu_refactor(k.starts.data(), k.rows.data(), values_.data(), k.symbolic, k.numeric, &k.common) == 1;
    if (refactored &&
        klu_rgrowth(k.starts.data(), k.rows.data(), values_.data(), k.symbolic, k.numeric, &k.common) == 1 &&
        k.common.rgrowth > kLeastGrowth) {
      return true;
    }
    klu_free_numeric(&k.numeric, &k.common);
  }
  k.numeric = klu_factor(k.starts.data(), k.rows.data(), values_.data(), k.symbolic, &k.common);
  return k.numeric && k.common.status == KLU_OK;
}

void SparseLu::solve(Eigen::Ref<Eigen::MatrixXd> b) const {
  if (klu_->size() == 0) return;
  klu_solve(klu_->symbolic, klu_->numeric, static_cast<int>(b.outerStride()), static_cast<int>(b.cols()), b.data(),
            &klu_->common);
}

void SparseLu::solve_transposed(Eigen::Ref<Eigen::MatrixXd> b) const {
  if (klu_->size() == 0) return;
  klu_tsolve(klu_->symbolic, klu_->numeric, static_cast<int>(b.outerStride()), static_cast<int>(b.cols()), b.data(),
             &klu_->common);
}

}  // namespace mbsopt
