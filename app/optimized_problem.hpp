// optimized.json: the problem of a run, --set included, with new parameter values; a problem file itself, which may lie
// in another folder (the paths of data files are rewritten). Comments are not kept.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "optim/problem.hpp"

namespace mbsopt {

// problem: as read from that file with those --set; folder: where the text will lie.
std::string optimized_problem_text(const std::string& problem_file, const std::vector<std::string>& sets,
                                   const Problem& problem, const std::vector<std::pair<std::string, double>>& values,
                                   const std::filesystem::path& folder);

}  // namespace mbsopt
