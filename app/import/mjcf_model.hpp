// MJCF, the models of MuJoCo (its documentation, "XML Reference"): bodies in bodies, joints between a body and its
// parent.
#pragma once

#include "app/import/imported_model.hpp"

namespace mbsopt {

// mujoco is the root element <mujoco>. Throws InputError with every finding.
ImportedModel mjcf_model(const XmlElement& mujoco, const std::string& file);

}  // namespace mbsopt
