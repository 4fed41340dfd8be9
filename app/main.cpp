#include <unistd.h>

#include <exception>
#include <iostream>

#include "app/command/command_line.hpp"
#include "app/starts/mpi_ranks.hpp"
#include "app/starts/rank_server.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/standard_streams.hpp"

int main(int argc, char** argv) {
  using namespace mbsopt;
  open_missing_standard_streams();
  std::unique_ptr<Ranks> ranks;
  try {
    ranks = mpi_ranks();
  } catch (const std::exception& error) {
    std::cerr << "mbsopt: " << error.what() << '\n';
    return kBadInput;
  }
  if (ranks && ranks->rank() > 0) return serve(*ranks);
  const int exit_code =
      run_command_line({argv + 1, argv + argc}, std::cout, std::cerr, isatty(STDERR_FILENO) == 1, ranks.get());
  if (ranks) dismiss(*ranks);
  return exit_code;
}
