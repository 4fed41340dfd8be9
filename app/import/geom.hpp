// The solids of MJCF: their mass, inertia and drawing. Axes and centre are those of the solid.
#pragma once

#include "app/import/imported_model.hpp"

namespace mbsopt::inline app {

struct Geom {
  std::string type;                                // sphere, capsule, cylinder, ellipsoid, box
  Eigen::Vector3d size = Eigen::Vector3d::Zero();  // half sides; radius; radius and half length along z  [m]
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
};

int sizes_of(const std::string& type);  // 1 to 3; 0: no solid has this type

double volume(const Geom& geom);  // [m^3]

// A uniform solid of mass 1 has these principal moments about its centre [m^2]:
//   box        (b^2 + c^2)/3, half sides a b c        ellipsoid  (b^2 + c^2)/5
//   cylinder   (3 r^2 + 4 h^2)/12, r^2/2              sphere     2 r^2/5
//   capsule    cylinder and two half spheres, each with its centre 3r/8 beyond the cylinder's end
Eigen::Vector3d unit_inertia(const Geom& geom);

// A box becomes a bar along its longest side, as wide as the longer of its other two sides.
ImportedShape shape_of(const Geom& geom);

}  // namespace mbsopt::inline app
