// Differences of all objectives in all parameters for the gradient check. The frozen ones use the accepted steps of the
// base run, the free ones step-size control. Each uses a ladder of steps whose values are kept.
//
//   GradientDifferences differences(run, {.relative_step = 1e-2, .rungs = 8, .free_steps = true});
//   const std::string failure = differences.take(k, true);       // in parameter k, on frozen steps
//   differences.of(true).derivative(i, k), differences.of(true).error(i, k);
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "optim/check/checked_run.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/objective/integration_error.hpp"

namespace mbsopt::inline optim {

// psi(h) + psi(-h) - 2 psi(0), divided by h, halves from 2h to h where psi is smooth, and is constant at a kink.
inline constexpr double kKinkFalls = 0.75;

// Central differences (psi(h) - psi(-h))/(2 h) before extrapolation; NaN where they were not evaluated.
struct LadderRung {
  double h = 0;
  double frozen = std::numeric_limits<double>::quiet_NaN(), free = std::numeric_limits<double>::quiet_NaN();
};

class GradientDifferences {
 public:
  struct Settings {
    double relative_step;  // the largest of a ladder, of the parameter's size
    int rungs;
    bool free_steps;
  };

  // Objective x parameter. An entry without a difference is 0, or NaN on frozen steps that do not serve.
  struct Table {
    Eigen::MatrixXd derivative, error, step;
  };

  GradientDifferences(CheckedRun& run, const Settings& settings);

  bool takes(Eigen::Index k, bool frozen) const { return frozen ? run_.on_frozen_steps(k) : settings_.free_steps; }
  // Sets column k. If it finds no derivative, it returns the message of a failed run.
  std::string take(Eigen::Index k, bool frozen);
  // Replaces the entries of these objectives in k by those of smaller steps, if they differ by more than their own
  // error. Returns whether one changed. psi_rounding has an entry per objective.
  bool take_finer(Eigen::Index k, bool frozen, const std::vector<Eigen::Index>& objectives,
                  const Eigen::VectorXd& psi_rounding);
  // Adds the integrator's errors to those of free differences from now on.
  void add(IntegrationError integration);

  const Table& of(bool frozen) const { return frozen ? frozen_ : free_; }
  const IntegrationError& integration() const { return integration_; }
  // The differences of each parameter step by relative_step times this: its size, or less if finer ones replaced them.
  const Eigen::VectorXd& size_of_steps() const { return size_of_steps_; }

  std::vector<LadderRung> rungs(Eigen::Index i, Eigen::Index k) const;
  // Returns b in  psi(+-h) = psi + s h +- b h + O(h^2)  at a kink, whose slopes on its two sides are s - b and s + b.
  // It is NaN if psi_i is smooth in k.
  double kink(Eigen::Index i, Eigen::Index k, bool frozen, double psi_rounding) const;

 private:
  struct Ladder {
    LadderDerivative d;
    std::string failure;                                           // of a run
    double other_steps = std::numeric_limits<double>::infinity();  // smallest |h| at which a run left the base's steps
  };
  Ladder ladder(Eigen::Index k, bool frozen, double largest);
  void keep(const Ladder& ladder, Eigen::Index i, Eigen::Index k, bool frozen);
  double own_error(const Ladder& ladder, Eigen::Index i, Eigen::Index k, bool frozen, double psi_rounding) const;
  void add_integration_error(Eigen::Index i, Eigen::Index k);
  double integration_error_of(Eigen::Index i, Eigen::Index k, double step) const;

  CheckedRun& run_;
  Settings settings_;
  Table frozen_, free_;
  IntegrationError integration_;
  Eigen::VectorXd size_of_steps_;
  Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic> on_base_steps_;  // a free difference
  // psi at h and -h on frozen and free steps, by parameter and |h|.
  std::map<std::pair<Eigen::Index, double>, std::array<std::array<Eigen::VectorXd, 2>, 2>> rungs_;
  Eigen::MatrixXd jump_;  // of psi, between the steps of the base run and free steps
};

}  // namespace mbsopt::inline optim
