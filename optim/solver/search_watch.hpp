// Ends a search by its last iterates, independent of its Hessian and of the remaining barrier.
//
//   optimal     stationary to the tolerance, by the measure of all methods (optimality.hpp)
//   stalled     ten iterations have changed f by noise only, which a line search would try to lower without end
//   wandering   30 iterations without a better point: the learnt curvature is useless after a wild motion
//   creeping    20 iterations have gained less than 1 % of f, none of them anywhere near a stationary point
//
// It reports wandering and creeping without constraints only: under constraints f tells less.
//
//   SearchWatch watch(1e-6, constraints == 0);
//   if (watch.look({x, f, distance}, best_f) == SearchEnd::stalled) x = watch.most_stationary().x;
#pragma once

#include <Eigen/Core>
#include <deque>
#include <limits>

namespace mbsopt {

enum class SearchEnd { none, optimal, stalled, wandering, creeping };

class SearchWatch {
 public:
  static constexpr int kStalled = 10, kWandering = 30, kCreeping = 20;  // iterations

  struct Iterate {
    Eigen::VectorXd x;
    double f = 0;         // scaled: its size and gradient about 1 at the start
    double distance = 0;  // optimality
  };

  SearchWatch(double tolerance, bool unconstrained) : tolerance_(tolerance), unconstrained_(unconstrained) {}

  // The iterate must be feasible. best_f is the lowest of all points, scaled.
  SearchEnd look(const Iterate& iterate, double best_f);
  // Starts a new search at the best point.
  void start_afresh();

  // The most stationary of the last kStalled + 1 iterates; there must be one.
  const Iterate& most_stationary() const;

 private:
  bool is_wandering(double f, double best_f);
  bool is_stalled() const;
  bool is_creeping() const;

  double tolerance_;
  bool unconstrained_;
  std::deque<Iterate> recent_;  // oldest first
  int without_better_ = 0;
  double best_f_ = std::numeric_limits<double>::infinity();
};

}  // namespace mbsopt
