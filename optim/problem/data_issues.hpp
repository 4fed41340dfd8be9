// Checks the data of an experiment: its columns exist, each is compared once, its times ascend, and every channel has
// measurements. Findings name the field of the problem that uses the data. It warns of
// angles that jump by a turn, and of units that may be mistaken.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// place is "identification.experiments[0]". scene gives its start time and its sensors.
std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, const Scene& scene);

}  // namespace mbsopt::inline optim
