// An unwrapped record may be whole turns away from the model, since a logger's angle begins anywhere. Its columns with
// "unwrap" are moved by as many turns as bring their first sample nearest to the model at its start.
//
//   for (const std::string& words : move_to_nearest_turn(problem, data)) ...   // what was moved
#pragma once

#include <string>
#include <vector>

#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// data: a table per experiment. A record whose model cannot be simulated at the start stays.
std::vector<std::string> move_to_nearest_turn(const Problem& problem, std::vector<CsvTable>& data);

}  // namespace mbsopt::inline optim
