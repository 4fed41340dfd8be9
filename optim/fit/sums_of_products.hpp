// Combinations of parameters that are sums of products, such as the base parameters of a mechanism:
//
//   I1 + m1*a1^2 + 0.04*m2,   m1*a1 + 0.2*m2,   I2 + m2*a2^2,   m2*a2
//
// Given is the space of their gradients at one point. A sum of terms belongs to it if its gradient leaves nothing
// orthogonal to the space. Terms are p, p^2, p q, p^2 q. Their coefficients are 1 or -1 between terms of one unit. The
// last one may be any number if the space leaves out at least two directions: a chance match would need two numbers to
// agree. Sums need the units of all parameters. They are searched in order of their length, until their gradients span
// the space.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace mbsopt::inline optim {

// Q: orthonormal columns, the gradients times size, a row per parameter. units: "" where not known. nullopt: no such
// sums span the space.
std::optional<std::vector<std::string>> sums_of_products(const Eigen::MatrixXd& Q, const Eigen::VectorXd& rho,
                                                         const Eigen::VectorXd& size,
                                                         const std::vector<std::string>& names,
                                                         const std::vector<std::string>& units);

// "m1 - 0.04*m2" of terms and their factors; the first factor is positive.
std::string sum_in_words(const std::vector<double>& factors, const std::vector<std::string>& terms);

}  // namespace mbsopt::inline optim
