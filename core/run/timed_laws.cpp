#include "core/run/timed_laws.hpp"

#include <utility>

#include "core/expression/program_switches.hpp"
#include "core/expression/time_parts.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/kinks_in_time.hpp"

namespace mbsopt {

std::vector<double> timed_inputs(const Mechanism& mechanism) {
  const Eigen::VectorXd& rho = mechanism.data().rho;
  std::vector<double> inputs(rho.begin(), rho.end());
  inputs.resize(inputs.size() + 3, 0.0);  // t comes next, or after the motion of a law of force
  return inputs;
}

std::vector<TimedLaw> timed_laws(const Mechanism& mechanism, std::span<const Cost> costs, double start, double end) {
  const MechanismData& d = mechanism.data();
  const int P = static_cast<int>(d.rho.size());
  const std::vector<double> inputs = timed_inputs(mechanism);
  std::vector<TimedLaw> laws;
  const auto add = [&](const Program& law, int time, int force, int drive) {
    for (Program& part : time_parts_of(law, P, time)) {
      std::vector<double> pieces = pieces_of(part, time, inputs, start, end);
      std::vector<double> jumps = jumps_of(part, time, inputs, pieces);
      laws.push_back({std::move(part), time, force, drive, std::move(pieces), std::move(jumps)});
    }
  };
  for (const RowLaw& law : d.laws)
    if (law.law.programs && !law.law.smooth) add((*law.law.programs)[2], P, -1, law.drive);
  d.forces->for_each([&]<class Kind>(const Kind& f) {
    if constexpr (HasLaw<Kind>)
      if (f.law.program) add(*f.law.program, P + 2, f.force, -1);
  });
  for (const AppliedForce& f : d.applied)
    for (const Program& component : f.components) add(component, P, f.force, -1);
  for (const Cost& cost : costs)
    if (const SwitchedProgram* const g = cost.running ? cost.running->program() : nullptr) add(g->program, P, -1, -1);
  return laws;
}

std::vector<KinkedSignal> kinks_of(const Mechanism& mechanism, std::span<const Cost> costs) {
  std::vector<KinkedSignal> kinks = mechanism.data().kinks;
  const Eigen::VectorXd& rho = mechanism.data().rho;
  for (const Cost& cost : costs)
    if (const SwitchedProgram* const p = cost.running ? cost.running->program() : nullptr)
      add_kinks_in_time(p->program, static_cast<int>(rho.size()), rho, kinks);
  return kinks;
}

}  // namespace mbsopt
