// optimized.json: the problem of a run with --set and new parameter values. It is a problem file itself, which may lie
// in another folder: the paths of data files are rewritten. Comments and formatting stay.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline app {

struct NewValue {
  std::string experiment;  // empty: of the parameter itself; else the value it takes in that experiment
  std::string parameter;
  double value = 0;  // SI
};

class Run;

// poses are those of the scene's bodies, modes the numbers of modes of eigenvalue objectives, if they must be written,
// too.
std::string optimized_problem_text(const Run& run, const std::vector<NewValue>& values,
                                   const std::vector<Body>& poses = {}, const std::map<std::string, int>& modes = {});

// recommended.json: the problem of the run with other integrator and formulation settings. Comments and formatting
// stay, except inside simulation.integrator and .formulation.
std::string recommended_problem_text(const Run& run, const SimulationSettings& settings);

}  // namespace mbsopt::inline app
