// Whether the data of an experiment can be used: its columns are there, each is compared once, its times ascend, and
// something was measured in every channel. Placed at the field of the problem that asks for it. Warnings: angles that
// jump by a turn.
#pragma once

#include <string>
#include <vector>

#include "core/scene/issues.hpp"
#include "optim/problem/csv_table.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt {

// place: "identification.experiments[0]"; scene: for its start time and its sensors.
std::vector<SceneIssue> find_data_issues(const ExperimentSpec& experiment, const std::string& place,
                                         const CsvTable& data, const Scene& scene);

}  // namespace mbsopt
