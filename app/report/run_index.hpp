// index.html of a folder of runs: links to all their reports, and a comparison of two of them.
#pragma once

#include <filesystem>
#include <string>

namespace mbsopt::inline app {

// Returns the page; empty if no folder holds a run. It reads only result.json of each run.
std::string run_index(const std::filesystem::path& runs);

// Writes it as runs/index.html, whole. It does not replace a page that run_index has not written.
void write_run_index(const std::filesystem::path& runs);  // throws WriteError

}  // namespace mbsopt::inline app
