// A model as the JSON of a problem file.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/import/imported_model.hpp"

namespace mbsopt {

// Bodies keep the frames of the model. Joints give points and axes in these, and normals where two frames are turned
// against each other; each revolute and translational joint has a sensor of its name. Damping and springs become
// forces. smooth_velocity: over which dry friction is smoothed [rad/s], [m/s].
// renamed: takes a sentence for each point whose name a problem file does not take.
nlohmann::ordered_json problem_of(const ImportedModel& model, double smooth_velocity,
                                  std::vector<std::string>& renamed);

// An entry of a list, or of an object in the object, takes a line.
std::string text_of(const nlohmann::ordered_json& problem);

}  // namespace mbsopt
