// The assembly modes of a mechanism whose joints and drives leave nothing free at one time: the distinct positions that
// satisfy them. They are solved for from the poses of the scene and from these with every body turned at random, about
// the plane's normal where there is a plane. For mechanisms with few loops this finds all of them; it proves nothing.
//
//   const std::vector<AssemblyMode> modes = assembly_modes(mechanism, 0);     // modes[0]: that of the scene's poses
//   set_guess(scene, mechanism, modes[1]);                                    // assembles to the other one
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

struct AssemblyMode {
  Eigen::VectorXd q;    // (r, p) per body
  double distance = 0;  // from the first: norm of the differences of r [m] and of rotation matrices
};

// The nearest first. Empty where something is free, or where the scene's poses do not close.
std::vector<AssemblyMode> assembly_modes(const Mechanism& mechanism, double t);

// Moves the poses of the scene's bodies to a mode of a mechanism made from it. What depends on parameters in them still
// does: positions are moved, angles about the axis of the turn and Euler parameters are turned. Orientations of other
// kinds become numbers.
void set_guess(Scene& scene, const Mechanism& mechanism, const AssemblyMode& mode);

}  // namespace mbsopt
