#include "core/driven/cost_switches.hpp"

#include <algorithm>

#include "core/expression/program_switches.hpp"

namespace mbsopt {

CostSwitches::CostSwitches(const Mechanism& mechanism, std::span<const Cost> costs) : mechanism_(mechanism) {
  for (const Cost& cost : costs) {
    const SwitchedProgram* const of = cost.running ? cost.running->program() : nullptr;
    if (!of) continue;
    for (const Program& p : of->switches) {
      if (p.used_inputs().empty() || p.used_inputs().back() < mechanism.parameters()) continue;
      switches_.push_back(&p);
      p.grow(scratch_);
    }
  }
  if (switches_.empty()) return;
  inputs_.resize(static_cast<std::size_t>(mechanism.parameters() + 1 + mechanism.sensors()));
  std::ranges::copy(mechanism.rho(), inputs_.begin());
}

double CostSwitches::value(std::size_t k, const StatePoint& at) {
  const int time = static_cast<int>(mechanism_.parameters());
  inputs_[static_cast<std::size_t>(time)] = at.t;
  for (const int input : switches_[k]->used_inputs())
    if (input > time) inputs_[static_cast<std::size_t>(input)] = mechanism_.sensor_value(input - time - 1, at);
  return switches_[k]->value(inputs_, scratch_);
}

}  // namespace mbsopt
