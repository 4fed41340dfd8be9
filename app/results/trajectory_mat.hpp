// The motion for MATLAB.
#pragma once

#include <string>
#include <vector>

#include "app/results/trajectory_csv.hpp"

namespace mbsopt::inline app {

// The unique names of the vectors: letters, digits and _, at most 63, beginning with a letter.
std::vector<std::string> mat_names(const std::vector<std::string>& columns);

// trajectory.mat: each column of trajectory.csv as a real vector under its name, for `load` in MATLAB. The sign "_"
// replaces a character that MATLAB's names do not allow: rod.x is rod_x.
//
// A MAT-file of level 5, uncompressed (The MathWorks, "MAT-File Format"). The library libmatio writes the same, but it
// needs HDF5 and 30 more shared libraries, which double the time that the program takes to start.
std::string to_mat(const Trajectory& trajectory);

}  // namespace mbsopt::inline app
