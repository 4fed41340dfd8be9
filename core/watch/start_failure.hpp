// Why a run cannot begin: no accelerations at its start. In words, with what to change.
#pragma once

#include <string>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

std::string start_failure(const MechanismData& data, double t);

}  // namespace mbsopt
