// Sparse LU of a square matrix with a constant pattern. It is ordered once and factored for each set of new values with
// the same pivots. It solves A x = b and A'x = b by KLU of SuiteSparse (Davis and Natarajan, "Algorithm 907: KLU", ACM
// TOMS 37 (2010)).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace mbsopt {

class SparseLu {
 public:
  struct Entry {
    int row, column;
  };
  // Entries may repeat: values of one place are added. slot(k) is the place of entry k's value.
  SparseLu(int size, const std::vector<Entry>& entries);
  ~SparseLu();
  SparseLu(SparseLu&&) noexcept;
  SparseLu& operator=(SparseLu&&) noexcept;

  int size() const;
  std::size_t slot(std::size_t entry) const { return slots_[entry]; }
  std::vector<double>& values() { return values_; }

  bool factor();                                               // false where a pivot is zero or a number is not finite
  void solve(Eigen::Ref<Eigen::MatrixXd> b) const;             // in place, size x columns
  void solve_transposed(Eigen::Ref<Eigen::MatrixXd> b) const;  // the same with A'

 private:
  struct Klu;
  std::unique_ptr<Klu> klu_;
  std::vector<std::size_t> slots_;
  std::vector<double> values_;
};

}  // namespace mbsopt
