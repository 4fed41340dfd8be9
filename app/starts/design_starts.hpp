// The minimisation of the design command: one run, or the best of a multistart. It writes a journal and can be resumed.
#pragma once

#include "app/starts/start_workers.hpp"
#include "optim/design/design.hpp"

namespace mbsopt::inline app {

// Adds what an end of a search may have: "maximised", "optimum", "assembly_mode", "closing_steps".
void add_kind_of_end(Json& json, const DesignResult& design);

struct DesignOutcome {
  DesignResult design;
  bool interrupted = false;  // before all starts had finished
};

DesignOutcome minimised(LongRun& long_run);

// The starts of its multistart, from the task of this process or another one.
StartWork design_start_work(Problem problem, const Json& task);

}  // namespace mbsopt::inline app
