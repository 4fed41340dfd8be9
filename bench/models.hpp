// Which models of a mechanism there are to be measured. The one place that knows how a model is asked for.
#pragma once

#include <string>
#include <vector>

#include "bench/linkage.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt::bench {

// "spatial": six unknowns per body.
inline std::vector<std::string> models_of(const Linkage&) { return {"spatial"}; }
inline void choose_model(SimulationSettings&, const std::string&) {}

}  // namespace mbsopt::bench
