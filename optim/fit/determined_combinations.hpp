// The combinations that data determine where they do not determine every parameter, in words.
//
// Given are directions in which nothing that is measured changes. Parameters that such directions tie together form a
// group. A group of c parameters with d directions has c - d determined combinations: those that are constant along
// every direction. To first order they are known from the directions alone, and are told in the simplest form that
// fits:
//
//   sums         "m1, m2: only m1 + m2 is determined"                    of parameters of one unit
//   products     "m, g, J: only m*g/J is determined"                     whole or half exponents
//   of products  "m, a, I: only m*a and I + m*a^2 are determined"        if units are known
//   otherwise    "a, b: only a + 0.25*b is determined"                   near this solution
// A group without any: "c: does not influence what is measured".
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace mbsopt::inline optim {

// Returns the combinations of parameters that data determine, in words. The independent columns of null_space are
// changes of the parameters over their positive sizes, rho their values. `units` has "" for an unknown unit, or is
// empty if none is known.
std::vector<std::string> determined_combinations(const Eigen::MatrixXd& null_space, const Eigen::VectorXd& rho,
                                                 const Eigen::VectorXd& size, const std::vector<std::string>& names,
                                                 const std::vector<std::string>& units = {});

// Parameters that the directions change.
std::vector<bool> changed_parameters(const Eigen::MatrixXd& null_space);

}  // namespace mbsopt::inline optim
