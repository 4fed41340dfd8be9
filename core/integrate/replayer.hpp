// Computes steps of a run again, bit for bit: what the backward sweep did not keep (checkpoints.hpp).
#pragma once

#include <functional>
#include <optional>

#include "core/integrate/checkpoints.hpp"
#include "core/integrate/runge_kutta_run.hpp"
#include "core/run/simulation_result.hpp"

namespace mbsopt {

class Replayer {
 public:
  // The arguments must outlive it.
  Replayer(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method,
           const StepSequence& steps)
      : mechanism_(mechanism), settings_(settings), method_(method), steps_(steps) {}

  // As Checkpoints::Replay. False also where go_on() is, which is asked before each stretch of steps.
  bool replay(const Snapshot& from, long last, const std::function<bool()>& dense,
              const std::function<void(const Step&)>& sink, const std::function<bool()>& go_on);
  long factorisations() const { return factorisations_; }

 private:
  const Mechanism& mechanism_;
  const SimulationSettings& settings_;
  const Method& method_;
  const StepSequence& steps_;
  std::optional<RungeKuttaRun> run_;  // made where it is needed
  long factorisations_ = 0;
};

}  // namespace mbsopt
