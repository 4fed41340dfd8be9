// The settings with which a formulation solves its equations by the factor S (saddle_solver.hpp): alpha and
// refinements.
#pragma once

#include <Eigen/Core>

#include "core/dynamics/saddle_solver.hpp"
#include "core/mechanism/mechanism_data.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt {

struct SaddleSettings {
  Eigen::VectorXd alpha;            // of S, per row
  double compliance;                // 1/alpha of the penalty form; 0: constrained
  Refinements values, derivatives;  // of a right-hand side, and of its tangents and adjoints
};

SaddleSettings saddle_settings(const MechanismData& data, const FormulationSettings& settings);

}  // namespace mbsopt
