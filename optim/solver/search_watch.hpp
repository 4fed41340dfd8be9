// Ends a search by its last iterates, independent of its Hessian and of the remaining barrier.
//
//   optimal     stationary to the tolerance, by the measure of all methods (optimality.hpp)
//   stalled     ten iterations have changed f by noise only, which a line search would try to lower without end
//   creeping    20 iterations have gained less than 1 % of f, none of them anywhere near a stationary point
//
// It reports creeping without constraints only: under constraints f tells less.
//
//   SearchWatch watch(1e-6, constraints == 0);
//   if (watch.look({x, f, distance}) == SearchEnd::stalled) x = watch.most_stationary().x;
#pragma once

#include <Eigen/Core>
#include <deque>

namespace mbsopt {

enum class SearchEnd { none, optimal, stalled, creeping };

class SearchWatch {
 public:
  static constexpr int kStalled = 10, kCreeping = 20;  // iterations

  struct Iterate {
    Eigen::VectorXd x;
    double f = 0;         // scaled: its size and gradient about 1 at the start
    double distance = 0;  // optimality
  };

  SearchWatch(double tolerance, bool unconstrained) : tolerance_(tolerance), unconstrained_(unconstrained) {}

  SearchEnd look(const Iterate& iterate);   // which must be feasible
  void start_afresh() { recent_.clear(); }  // for a new search at the best point

  // The most stationary of the last kStalled + 1 iterates; there must be one.
  const Iterate& most_stationary() const;

 private:
  bool is_stalled() const;
  bool is_creeping() const;

  double tolerance_;
  bool unconstrained_;
  std::deque<Iterate> recent_;  // oldest first
};

}  // namespace mbsopt
