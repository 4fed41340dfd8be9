// A multistart of an identification: the problem with the values of the best start's fit. The final fit begins there.
#pragma once

#include <vector>

#include "app/starts/start_workers.hpp"
#include "optim/fit/identification.hpp"
#include "optim/problem/csv_table.hpp"

namespace mbsopt::inline app {

struct BestStart {
  Problem problem;
  long simulations = 0;     // of all starts
  double wall_seconds = 0;  // added up over them
};

// Returns the given problem if there is no multistart. Shared variables are spread over their bounds. Parameters that
// are free in an experiment begin at their given values.
BestStart from_best_start(LongRun& long_run, const std::vector<CsvTable>& data);

// The starts, from the task of this process or another one.
StartWork identify_start_work(const Problem& problem, const Json& task);

// The records of the experiments, in their order, on the turn nearest to the model. moved receives what was moved.
std::vector<CsvTable> data_of(const Problem& problem, std::vector<std::string>* moved = nullptr);

// Sets "initial" of each parameter to its given value, not to that of the best start.
void describe_given(const Problem& given, IdentificationResult& fit);

}  // namespace mbsopt::inline app
