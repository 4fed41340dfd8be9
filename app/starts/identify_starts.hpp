// A multistart of an identification: the problem with the values of the best start's fit, from which the fit proper
// begins.
#pragma once

#include <vector>

#include "app/run/long_run.hpp"
#include "app/starts/start_workers.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt {

struct BestStart {
  Problem problem;
  long simulations = 0;     // of all starts
  double wall_seconds = 0;  // added up over them
};

// The given problem where no multistart is asked for. Shared variables are spread over their bounds; parameters that
// are free in an experiment begin at their given values.
BestStart from_best_start(Run& run, LongRun& long_run, const std::vector<CsvTable>& data);

// The starts, from the task that this process or another one has made.
StartWork identify_start_work(const Problem& problem, const Json& task);

// The records of the experiments, in their order.
std::vector<CsvTable> data_of(const Problem& problem);

// Ends a run that was interrupted before the fit proper began; best: from_best_start(). Returns the exit code.
int stopped_within_starts(Run& run, LongRun& long_run, const Problem& best);

// "initial" of each parameter: as it was given, not where the best start had brought it.
void describe_given(const Problem& given, IdentificationResult& fit);

}  // namespace mbsopt
