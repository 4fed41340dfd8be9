// The windows of experiments: into result.json, "windows", and onto standard output.
#pragma once

#include "app/run/run.hpp"

namespace mbsopt {

// cut is the result of cut_into_windows.
void add_windows(Run& run, const Problem& cut);

}  // namespace mbsopt
