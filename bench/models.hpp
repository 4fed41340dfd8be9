// Which models of a mechanism there are to be measured. The one place that knows how a model is asked for.
#pragma once

#include <string>
#include <vector>

#include "bench/linkage.hpp"
#include "core/scene/settings.hpp"

namespace mbsopt::bench {

// "planar": three unknowns per body, "spatial": six. The first is the one that runs take by themselves.
inline std::vector<std::string> models_of(const Linkage& linkage) {
  if (linkage.planar()) return {"planar", "spatial"};
  return {"spatial"};
}
inline void choose_model(SimulationSettings& settings, const std::string& model) {
  settings.model = model == "planar" ? ModelChoice::planar : ModelChoice::spatial;
}

}  // namespace mbsopt::bench
