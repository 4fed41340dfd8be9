// A model as the JSON of a problem file.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/import/imported_model.hpp"

namespace mbsopt {

// Bodies keep the frames of the model. Joints give points and axes in these, and normals if two frames are turned
// against each other. Each revolute and translational joint has a sensor of its name. Damping and springs become
// forces. smooth_velocity smooths dry friction [rad/s], [m/s]. renamed receives a sentence for each changed name of a
// point.
nlohmann::ordered_json problem_of(const ImportedModel& model, double smooth_velocity,
                                  std::vector<std::string>& renamed);

// Writes one line per entry of a list, or of an object inside the object.
std::string text_of(const nlohmann::ordered_json& problem);

}  // namespace mbsopt
