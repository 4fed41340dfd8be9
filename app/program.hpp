// mbsopt's command line in a program of your own: every command, for problem files that call the program's forces,
// costs and laws by name.
//
//   int main(int argc, char** argv) {
//     mbsopt::NamedTerms terms;
//     terms.add_cost("hangs", {}, std::make_shared<Hangs>());
//     return mbsopt::run_program({argv + 1, argv + argc}, terms);   // ./mine design pendulum.json --threads 4
//   }
#pragma once

#include <string>
#include <vector>

#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

// arguments hold the command, then its file and options. Results go into the folder of the run and to standard output,
// messages on faults to standard error. Returns the exit code: 0 done, 1 a numerical failure, 2 bad input, 3 a failed
// check, 130 interrupted.
int run_program(const std::vector<std::string>& arguments, const NamedTerms& terms = {});

}  // namespace mbsopt::inline app
