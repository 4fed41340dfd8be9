// The message of a failed assembly: the joints and conditions that stay violated, by how much, and what to try.
#pragma once

#include <string>

#include "core/start/assembly_equations.hpp"
#include "core/start/nearest_point.hpp"

namespace mbsopt {

std::string assembly_failure(const MechanismData& data, const AssemblyEquations& equations, const NearestPoint& found);

}  // namespace mbsopt
