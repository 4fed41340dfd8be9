// The reason why a run cannot begin without accelerations at its start, in words, with a remedy.
#pragma once

#include <string>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

std::string start_failure(const MechanismData& data, double t);

}  // namespace mbsopt
