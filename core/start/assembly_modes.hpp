// The assembly modes of a mechanism whose joints and drives leave nothing free at one time: the distinct positions that
// satisfy them. They are solved for from the poses of the scene and from these with every body turned at random, about
// the plane's normal where there is a plane. For mechanisms with few loops this finds all of them; it proves nothing.
// Positions with a joint inside out, which its dot products allow, are none: an axis or a normal points the other way.
//
//   const std::vector<AssemblyMode> modes = assembly_modes(mechanism, 0);     // modes[0]: that of the scene's poses
//   set_guess(scene, mechanism, modes[1]);                                    // assembles to the other one
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/mechanism/mechanism.hpp"

namespace mbsopt {

struct AssemblyMode {
  Eigen::VectorXd q;    // (r, p) per body
  double distance = 0;  // from the first: norm of the differences of r [m] and of rotation matrices
};

// The nearest first; where the scene's poses do not lead to a mode, from the one found first. Empty where something is
// free, or none is found. go_on: asked before every guess after the first; false ends the search with what it has
// found.
std::vector<AssemblyMode> assembly_modes(const Mechanism& mechanism, double t, const std::function<bool()>& go_on = {});

// Moves the poses of the scene's bodies to a mode of a mechanism made from it: positions are moved, orientations turned
// in global axes. What depends on parameters in them still does, so that relative orientations which joints take from
// the poses stay the same functions of the parameters.
void set_guess(Scene& scene, const Mechanism& mechanism, const AssemblyMode& mode);

}  // namespace mbsopt
