// Searches of a design from the problem's own values: from its poses, or in one of the assembly modes that its
// mechanism has at the start (core/start/assembly_modes.hpp).
#pragma once

#include <vector>

#include "core/start/assembly_modes.hpp"
#include "optim/design/design_result.hpp"

namespace mbsopt::inline optim {

DesignResult single_design(const Problem& problem, const DesignOptions& options);

// options.mode must be there.
DesignResult design_in_mode(const Problem& problem, const DesignOptions& options);

struct StartModes {
  std::vector<AssemblyMode> modes;
  bool abandoned = false;
};

// At the problem's own values; those found so far if options.simulation_progress abandons the search.
StartModes modes_at(const Scene& scene, const DesignOptions& options);

}  // namespace mbsopt::inline optim
