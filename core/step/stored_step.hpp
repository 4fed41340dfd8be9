// The record of a step for a backward sweep, in one piece of memory; stages are rebuilt from their accelerations.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/run/sample_schedule.hpp"
#include "core/step/step.hpp"

namespace mbsopt {

struct StoredStep {
  double t = 0, h = 0, t1 = 0;
  bool dense = false;
  std::vector<SampleEvent> samples;  // of costs

  StoredStep(const Step& step, const Method& rk, std::span<const SampleEvent> events);
  // All of it but the stages Y, their velocities in K, and the angles at the end. step: of the same sizes.
  void restore(const Method& rk, Step& step) const;
  Eigen::Map<const Eigen::VectorXd> y0() const { return {numbers_.get(), states_}; }
  Eigen::Map<const Eigen::VectorXd> y1() const { return {numbers_.get() + 2 * states_ + angles_, states_}; }
  Eigen::Map<const Eigen::VectorXd> angles0() const { return {numbers_.get() + states_, angles_}; }
  std::size_t bytes() const;

 private:
  Eigen::Index states_, angles_, count_ = 0;
  std::unique_ptr<double[]> numbers_;  // the parts of a step: y0, angles0, y_hat, y1, and the others
};

}  // namespace mbsopt
