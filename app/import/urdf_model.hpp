// URDF, the robot description of ROS (https://wiki.ros.org/urdf/XML): links and joints that form a tree.
#pragma once

#include "app/import/imported_model.hpp"

namespace mbsopt {

// robot is the root element <robot>. Throws InputError with every finding.
ImportedModel urdf_model(const XmlElement& robot, const std::string& file);

}  // namespace mbsopt
