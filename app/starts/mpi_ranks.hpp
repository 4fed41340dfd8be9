// The ranks of an MPI run:
//
//   mpirun -n 8 mbsopt identify problem.json
#pragma once

#include <memory>

#include "app/starts/ranks.hpp"

namespace mbsopt {

// Joins the run that mpirun has started this process for; null where it has not, or started this one only. MPI is not
// touched then. Throws std::runtime_error where this build has no MPI, or finds no library.
std::unique_ptr<Ranks> mpi_ranks();

}  // namespace mbsopt
