// The ranks of an MPI run:
//
//   mpirun -n 8 mbsopt identify problem.json
#pragma once

#include <memory>

#include "app/starts/ranks.hpp"

namespace mbsopt {

// Joins the run for which mpirun started this process. Returns null, without MPI, if it did not, or if it started one
// process only. Throws std::runtime_error if this build has no MPI, or finds no library.
std::unique_ptr<Ranks> mpi_ranks();

}  // namespace mbsopt
