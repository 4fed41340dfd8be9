// y = y0 + sum_j c_j k_j of states in one pass: each number of y is read and written once. It takes two more k_j than a
// method has stages.
#pragma once

#include <Eigen/Core>

#include "core/linear/columns.hpp"
#include "core/tableau/method.hpp"

namespace mbsopt {

class StageSum {
 public:
  // to() reads the first terms_ entries only, so the arrays need no values.
  StageSum() {}  // cppcheck-suppress uninitMemberVar
  // k has as many numbers as y. It is not read if c is 0.
  void add(double c, const double* k) {
    if (c == 0) return;
    c_[terms_] = c;
    k_[terms_++] = k;
  }
  // y may be y0.
  void to(const double* y0, double* y, Eigen::Index size) const {
    constexpr int kAtOnce = 8;
    Eigen::Index r = 0;
    for (; r + kAtOnce <= size; r += kAtOnce) {
      Column<Pairs, kAtOnce> sum(y0 + r);
      for (int j = 0; j < terms_; ++j) sum.add(c_[j], k_[j] + r);
      sum.store(y + r);
    }
    for (; r < size; ++r) {
      double sum = y0[r];
      for (int j = 0; j < terms_; ++j) sum += c_[j] * k_[j][r];
      y[r] = sum;
    }
  }

 private:
  double c_[Method::kMaxStages + 2];
  const double* k_[Method::kMaxStages + 2];
  int terms_ = 0;
};

}  // namespace mbsopt
