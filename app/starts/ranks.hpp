// The processes of a run that spans several, perhaps on several machines. Rank 0 runs the command, reads and writes all
// files and prints. The others compute on its orders (start_workers.hpp).
//
// Messages are JSON:
//   to a rank   {"work": {...}} {"start": 7} {"stop": true} {"dismissed": true}
//   to rank 0   {"reply": 7, "ok": true, "text": "..."} {"interrupted": true} {"failed": "why"}
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

// The interval between checks for messages. MPI itself would wait at full speed.
inline constexpr int kPollMilliseconds = 5;

struct Ranks {
  virtual ~Ranks() = default;
  virtual int rank() const = 0;
  virtual int size() const = 0;

  struct Message {
    int from = 0;
    std::string text;
  };
  // If both sides sent long texts to each other, both would wait for ever. So only one side may send them.
  virtual void send(int to, const std::string& text) = 0;
  virtual std::optional<Message> receive() = 0;  // does not wait: none where nothing has come
};

// The ranks of an MPI run (mpirun -n 8 mbsopt identify problem.json): joins the run for which mpirun started this
// process. Returns null, without MPI, if it did not, or if it started one process only. Throws std::runtime_error if
// this build has no MPI, or finds no library.
std::unique_ptr<Ranks> mpi_ranks();

// A rank other than 0 computes starts until rank 0 dismisses all (rank_server.cpp). terms are those of the program.
// Returns the exit code.
int serve(Ranks& ranks, const NamedTerms& terms = {});
void dismiss(Ranks& ranks);

}  // namespace mbsopt::inline app
