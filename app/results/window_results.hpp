// The windows into which experiments are cut: into result.json, "windows", and onto standard output.
#pragma once

#include "app/run/run.hpp"

namespace mbsopt {

// cut: from cut_into_windows.
void add_windows(Run& run, const Problem& cut);

}  // namespace mbsopt
