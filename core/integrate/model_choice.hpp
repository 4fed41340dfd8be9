// Chooses the model of a Runge-Kutta run: three unknowns per body or six.
#pragma once

#include "core/mechanism/mechanism.hpp"
#include "core/scene/settings.hpp"
#include "core/tableau/tableaus.hpp"

namespace mbsopt {

// The penalty form is planar on request only: its joints give way to loads across the plane, too. Throws SceneError
// where the settings ask for the planar model and there is none.
Model model_of(const Mechanism& mechanism, const SimulationSettings& settings, const Method& method);

// Adds to a summary what the settings make of the mechanism.
void add_model(const Mechanism& mechanism, const SimulationSettings& settings, ModelSummary& summary);

}  // namespace mbsopt
