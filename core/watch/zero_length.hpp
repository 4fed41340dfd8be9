// A tsda that goes through zero length with a force: its direction turns round at once. The motion goes on rightly, by
// small steps; its derivatives do not, since how the moment of the jump moves is not among the steps' derivatives.
#pragma once

#include <Eigen/Core>
#include <string>

#include "core/mechanism/mechanism_data.hpp"

namespace mbsopt {

// Between two states, a step apart: which spring did, in words; empty: none.
std::string through_zero_length(const MechanismData& data, double t0, const Eigen::VectorXd& y0, double t1,
                                const Eigen::VectorXd& y1);

}  // namespace mbsopt
