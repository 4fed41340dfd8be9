#include "app/results/left_out_bodies.hpp"

#include <fmt/format.h>

#include "core/mechanism/derivative_blocks.hpp"

namespace mbsopt {

void say_left_out(Run& run, const std::vector<std::string>& bodies, const char* judged_by) {
  if (bodies.empty()) return;
  run.result["model"]["left_out"] = bodies;
  run.context.out << fmt::format("not simulated, since no {} depends on them: {}\n", judged_by,
                                 fmt::join(bodies, ", "));
}

void add_derivative_counts(Run& run, const Scene& simulated, const SimulationStatistics& statistics) {
  const Mechanism mechanism(simulated, parameter_values(simulated));
  Json& json = run.result["simulation"];
  json["derivative_blocks"] = statistics.linearised_states * derivative_blocks(mechanism.data());
  json["differentiated_numbers"] = mechanism.data().slots();
}

}  // namespace mbsopt
