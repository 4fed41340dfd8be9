// The assignment of rows to columns, one to one, that has the largest sum of gains.
//
//   one_to_one(gain)[i];   // the column of row i; -1: none, as there are fewer columns
//
// Shortest augmenting paths, row by row: H. W. Kuhn, "The Hungarian method for the assignment problem", Naval Research
// Logistics Quarterly 2 (1955) 83; R. Jonker, A. Volgenant, Computing 38 (1987) 325. Of order rows^2 columns.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace mbsopt::inline optim {

std::vector<Eigen::Index> one_to_one(const Eigen::MatrixXd& gain);

}  // namespace mbsopt::inline optim
