// optimized.json: the problem of a run, --set included, with new parameter values; a problem file itself, which may lie
// in another folder (the paths of data files are rewritten). Comments and formatting stay as they were written.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt {

struct NewValue {
  std::string experiment;  // empty: of the parameter itself; else the value it takes in that experiment
  std::string parameter;
  double value = 0;  // SI
};

class Run;

// poses: of the scene's bodies, where they are to be written, too.
std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values,
                                   const std::vector<Body>& poses = {});

// problem: as read from that file with those --set; folder: where the text will lie.
std::string optimized_problem_text(const std::string& problem_file, const std::vector<std::string>& sets,
                                   const Problem& problem, const std::vector<NewValue>& values,
                                   const std::filesystem::path& folder);

}  // namespace mbsopt
