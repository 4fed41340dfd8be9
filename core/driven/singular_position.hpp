// The positions of a solved run at which J = Phi_q loses rank: the rank lost, and the joints and drives whose equations
// depend on each other.
#pragma once

#include <string>

#include "core/mechanism/mechanism.hpp"
#include "core/scene/settings.hpp"
#include "core/start/singular_window.hpp"

namespace mbsopt {

inline constexpr double kDrivenRankThreshold = 1e-7;  // of rows of J scaled to unit length
inline constexpr double kDigitsOfInstant = 1e-3;      // the same at an instant that is known to some digits

SingularPosition singular_position(const Mechanism& mechanism, double t, const Eigen::VectorXd& y,
                                   double threshold = kDigitsOfInstant);

// The reason why the positions cannot be continued from a state at t, in words: a jump of a law, or the position.
std::string why_stuck(const Mechanism& mechanism, const SimulationSettings& settings, double t,
                      const Eigen::VectorXd& y);

}  // namespace mbsopt
