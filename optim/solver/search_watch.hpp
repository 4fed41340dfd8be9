// Ends of a search that depend neither on its Hessian nor on what is left of a barrier: what the last iterates say.
//
//   optimal     stationary to the tolerance, by the yardstick of all methods (optimality.hpp)
//   stalled     ten iterations have changed f by noise only, which a line search would go on trying to lower
//   wandering   30 iterations without a better point: lost in what was learnt from a wild motion
//   creeping    20 iterations have gained less than 1 % of f, none of them anywhere near a stationary point
//
// Wandering and creeping are said without constraints only: under constraints f tells less.
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

  // A feasible iterate; best_f: of all points seen, scaled.
  SearchEnd look(const Iterate& iterate, double best_f);
  // A search begins anew, at the best point.
  void start_afresh();

  // Of the last kStalled + 1; there must have been one.
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
