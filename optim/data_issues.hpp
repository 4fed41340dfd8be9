// Whether the data of an experiment can be used: its columns are there, its times ascend, and something was measured
// after the start. Placed at the field of the problem that asks for it.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "optim/csv_table.hpp"
#include "optim/problem.hpp"

namespace mbsopt {

// place: "identification.experiments[0]"; start_time: of the simulation, for an experiment without its own.
std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, double start_time);

}  // namespace mbsopt
