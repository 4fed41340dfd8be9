// The largest or least values of expressions over a run, with the local ones beside them, on given steps.
//
// The dense output is evaluated at eight points of each step and at the times of the rows of a trajectory, and then
// near the tops of parabolas through three of them. If the motion is solved, it halves the brackets of tops until rtol.
//
//   const auto found = peaks({{1, force}}, mechanism, settings, run.steps);
//   found[0].front().value        // the largest force
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/mechanism/mechanism.hpp"
#include "core/run/simulation_result.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt::inline optim {

struct Watched {
  int side = 1;  // -1: its least values
  std::shared_ptr<const PointCost> x;
};

struct Peak {
  double t = 0, value = 0;  // the motion reaches the value
  double top = 0;           // time of the top of the parabola through this and its neighbours
};

// At most this many of one expression: those of the most extreme values.
inline constexpr std::size_t kMostPeaks = 8;

// Per expression at least one peak, the most extreme one first. Nothing if the run fails, or if progress, called after
// steps as in RunOptions, stops it.
std::vector<std::vector<Peak>> peaks(const std::vector<Watched>& watched, const Mechanism& mechanism,
                                     const SimulationSettings& settings, const StepSequence& steps,
                                     const std::function<bool(double t)>& progress = {});

}  // namespace mbsopt::inline optim
