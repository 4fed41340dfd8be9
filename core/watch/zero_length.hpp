// A tsda that passes zero length with a force reverses its direction at once. The motion stays right with small steps.
// Its derivatives do not: they omit how the moment of the jump moves.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

// Names the spring that did so between two states, a step apart, in words; empty if none did.
std::string through_zero_length(const MechanismData& data, double t0, const Eigen::VectorXd& y0, double t1,
                                const Eigen::VectorXd& y1);

}  // namespace mbsopt
