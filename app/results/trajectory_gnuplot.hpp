// trajectory.gp: a gnuplot script that plots each sensor of trajectory.csv, and the position of each body.
#pragma once

#include <string>

#include "core/scene/scene.hpp"

namespace mbsopt {

std::string gnuplot_script(const Scene& scene);

}  // namespace mbsopt
