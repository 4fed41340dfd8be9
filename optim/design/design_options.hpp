// Options of a design that the problem does not give.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "optim/design/design_result.hpp"

namespace mbsopt::inline optim {

struct DesignOptions {
  GradientMethod method = GradientMethod::automatic;
  std::vector<std::shared_ptr<const UserForce>> user_forces;
  int threads = 1;                                    // that compute load cases
  std::function<bool(const DesignRow&)> progress;     // after every iteration; false stops, the best so far is kept
  std::function<bool(double t)> simulation_progress;  // within a simulation; false abandons it
  bool evaluate_stopped = true;                       // the end point of an abandoned search: a last evaluation
  PointRecords* records = nullptr;                    // of an earlier run that this one goes on with
  bool compare_differences = true;                    // at the start, difference_comparison.hpp; in the warnings
  // The scale that judges convergence; if absent, about 1 over the objective and its gradient at the start. Runs from
  // several starts share one, so that "converged" means the same of all.
  std::optional<NlpScale> scale = {};
  std::optional<int> mode = {};  // assembly mode at the start (DesignMode); none: that of the scene's poses
};

}  // namespace mbsopt::inline optim
