// A model as the text of a problem file.
#pragma once

#include <string>

#include "app/import/imported_model.hpp"

namespace mbsopt::inline app {

// Bodies keep the frames of the model. Joints give points and axes in these, and normals if two frames are turned
// against each other. Each revolute and translational joint has a sensor of its name. Damping and springs become
// forces. Each entry of a list has a line. model.changed receives what the problem file says otherwise.
std::string problem_text(ImportedModel& model);

}  // namespace mbsopt::inline app
