// The assembly modes of a mechanism whose joints and drives leave no freedom at one time: the distinct positions that
// satisfy them. The search starts from the poses of the scene and from random turns of every body, about the plane's
// normal if there is a plane. For mechanisms with few loops this finds all modes, but proves nothing. Dot products also
// allow positions with a joint inside out: an axis or a normal is opposite. These are no modes.
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

// Returns the nearest mode first; if the scene's poses lead to no mode, nearest to the one found first. Returns nothing
// if there is freedom, or if none is found. It calls go_on before every guess after the first; false ends the search
// with the modes found so far.
std::vector<AssemblyMode> assembly_modes(const Mechanism& mechanism, double t, const std::function<bool()>& go_on = {});

// Moves the poses of the scene's bodies to a mode of a mechanism made from it: it shifts positions, and turns
// orientations in global axes. Their dependence on parameters stays. So relative orientations that joints take from the
// poses stay the same functions of the parameters.
void set_guess(Scene& scene, const Mechanism& mechanism, const AssemblyMode& mode);

}  // namespace mbsopt
