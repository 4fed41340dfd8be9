#include "core/run/kinks.hpp"

#include "core/expression/program_switches.hpp"
#include "core/mechanism/kinks_in_time.hpp"

namespace mbsopt {

std::vector<KinkedSignal> kinks_of(const Mechanism& mechanism, std::span<const Cost> costs) {
  std::vector<KinkedSignal> kinks = mechanism.data().kinks;
  const Eigen::VectorXd& rho = mechanism.data().rho;
  for (const Cost& cost : costs)
    if (const SwitchedProgram* const p = cost.running ? cost.running->program() : nullptr)
      add_kinks_in_time(p->program, static_cast<int>(rho.size()), rho, kinks);
  return kinks;
}

}  // namespace mbsopt
