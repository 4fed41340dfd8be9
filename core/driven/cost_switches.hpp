// The switches (program_switches.hpp) of running costs along a motion. Where one changes its sign, the integrand may
// have a kink or jump, so that a panel should end there.
#pragma once

#include <span>
#include <vector>

#include "core/expression/program.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/run/cost.hpp"

namespace mbsopt {

class CostSwitches {
 public:
  // The costs must outlive it.
  CostSwitches(const Mechanism& mechanism, std::span<const Cost> costs);

  std::size_t count() const { return switches_.size(); }
  double value(std::size_t k, const StatePoint& at);

 private:
  const Mechanism mechanism_;
  std::vector<const Program*> switches_;  // that depend on the time or the motion
  std::vector<double> inputs_;            // parameters, t, sensors
  Program::Scratch scratch_;
};

}  // namespace mbsopt
