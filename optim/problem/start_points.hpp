// The starting points of a multistart.
//
//   latin_hypercube   every variable takes one value in each of n equal slices of its range, in random order:
//                     McKay, Beckman and Conover, Technometrics 21 (1979) 239-245
//   sobol             the low-discrepancy sequence of Sobol' with Joe and Kuo's direction numbers (SIAM J. Sci. Comput.
//                     30 (2008) 2635-2654), shifted by a random vector modulo 1 (Cranley and Patterson 1976)
//
// The same seed gives the same points on every machine. Ranges are those of the scaled variables: a stiffness with
// "scale": "log" has evenly spread logarithms.
//
//   const auto starts = start_values({k1, L1}, *spec.multistart, seed);   // starts[0]: the given values
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "core/scene/scene.hpp"
#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// A seed that is not given is drawn once and reported, so that any run can be repeated: 0 to 2^31 - 1, from the system.
inline long drawn_seed() { return static_cast<long>(std::random_device()() & 0x7fffffffU); }

// Returns count points of the unit cube, one per column.
Eigen::MatrixXd unit_points(StartSampling sampling, Eigen::Index dimension, Eigen::Index count, long seed);

// Values of the parameters at each start; they must have bounds (starts_issues).
std::vector<Eigen::VectorXd> start_values(const std::vector<Parameter>& parameters, const MultistartSpec& spec,
                                          long seed);

}  // namespace mbsopt::inline optim
