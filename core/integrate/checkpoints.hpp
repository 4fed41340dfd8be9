// The states that an adjoint run keeps of the forward motion, within a budget of memory.
//
// While all steps fit they are kept, and nothing is computed twice. Beyond that the forward run keeps the state at the
// start of every k-th step. k doubles whenever these snapshots fill half of the budget. The backward sweep computes the
// steps from one snapshot to the next again and keeps them. If they do not fit either, it takes more snapshots in
// between by the binomial rule. The steps are those of the forward run, bit for bit, so that derivatives do not depend
// on the budget.
//
//   N blocks of steps are reversed from s snapshots (the one at their start included) with nearly the least number of
//   block evaluations beside those that keep steps, r N - beta(s + 1, r - 1), beta(s, r) = (s + r)!/(s! r!), r the
//   least with beta(s, r) >= N:  Griewank, Walther, "Algorithm 799: revolve", ACM TOMS 26 (2000).
#pragma once

#include <deque>
#include <functional>
#include <utility>

#include "core/step/stored_step.hpp"
#include "core/watch/step_observer.hpp"

namespace mbsopt {

// The state before a step, from where the run may go on.
struct Snapshot {
  long step = 0;
  Eigen::VectorXd y0, angles;
};

// Where to place the next snapshot: after how many of N >= 2 blocks, with s snapshots in all.
long binomial_split(long blocks, long snapshots);

class Checkpoints : private StepObserver {
 public:
  Checkpoints(const Method& method, double budget_mib);

  // Forward: each accepted step in turn, with the samples in it.
  void keep(const Step& step, std::span<const SampleEvent> events);

  // Computes the steps from a snapshot to `last` (not included) again, and shows each to an observer. Returns whether
  // it succeeds.
  using Replay = std::function<bool(const Snapshot& from, long last, StepObserver& sink)>;
  // The state after the last step of a replay, and after an impact that ends it.
  void set_end(const Eigen::VectorXd& y0, const Eigen::VectorXd& angles) {
    again_.end.y0 = y0;
    again_.end.angles = angles;
  }
  using StepBack = std::function<bool(const StoredStep&)>;
  // Backward: every step, the last one first. False as soon as either function says so.
  bool go_back(const Replay& replay, const StepBack& back);

  std::size_t peak_bytes() const { return peak_; }
  long recomputed_steps() const { return recomputed_; }

 private:
  std::size_t listed() const;  // of the list of steps and its samples
  std::size_t limit() const;   // of what is kept beside it
  void count(std::size_t more);
  void add(Snapshot s);
  void thin_out();
  void turn_steps_into_snapshots();
  bool reverse(const Snapshot& from, long last);
  bool reverse_blocks(const Snapshot& from, long last, long block, long snapshots);
  // Computes steps from..last again and keeps those from `first` on.
  bool run_again(const Snapshot& from, long first, long last);
  std::span<const std::pair<long, SampleEvent>> samples() const;  // in the step that is computed again
  bool reads_inside(double) const override { return again_.index >= again_.first && !samples().empty(); }
  std::string look_at(const SeenStep& step) override;
  bool back_over_kept();

  const Method& rk_;
  std::size_t budget_, bytes_ = 0, peak_ = 0;
  std::size_t step_bytes_ = 0, snapshot_bytes_ = 0;  // of one step with dense output, of one snapshot
  long steps_ = 0, every_ = 0, recomputed_ = 0;      // every_: distance of snapshots; 0 while all steps are kept
  std::deque<StoredStep> kept_;
  std::deque<Snapshot> snapshots_;
  std::vector<std::pair<long, SampleEvent>> events_;  // by step, where steps are not kept
  struct {
    long index = 0, first = 0, last = 0;  // of the next step
    Snapshot end;                         // after the last one
  } again_;
  Replay replay_;
  StepBack back_;
};

}  // namespace mbsopt
