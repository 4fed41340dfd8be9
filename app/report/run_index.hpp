// index.html of a folder that holds folders of runs: all of them with links to their reports, two of them compared.
#pragma once

#include <filesystem>
#include <string>

namespace mbsopt {

// The page; empty where no folder holds a run. Only result.json of each run is read.
std::string run_index(const std::filesystem::path& runs);

// Writes it as runs/index.html, whole. A page of this name that no run_index wrote is left alone.
void write_run_index(const std::filesystem::path& runs);  // throws WriteError

}  // namespace mbsopt
