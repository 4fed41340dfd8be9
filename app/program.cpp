#include "app/program.hpp"

#include <unistd.h>

#include <exception>
#include <iostream>
#include <memory>

#include "app/command/command_line.hpp"
#include "app/starts/ranks.hpp"
#include "app/terminal/exit_code.hpp"
#include "app/terminal/standard_streams.hpp"

namespace mbsopt::inline app {

int run_program(const std::vector<std::string>& arguments, const NamedTerms& terms) {
  open_missing_standard_streams();
  std::unique_ptr<Ranks> ranks;
  try {
    ranks = mpi_ranks();
  } catch (const std::exception& error) {
    std::cerr << "mbsopt: " << error.what() << '\n';
    return kBadInput;
  }
  if (ranks && ranks->rank() > 0) return serve(*ranks, terms);
  const int exit_code =
      run_command_line(arguments, std::cout, std::cerr, isatty(STDERR_FILENO) == 1, ranks.get(), terms);
  if (ranks) dismiss(*ranks);
  return exit_code;
}

}  // namespace mbsopt::inline app
