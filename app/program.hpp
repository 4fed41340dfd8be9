// mbsopt's command line in a program of your own: every command, with all that it does, for problem files that call the
// program's forces, costs and laws by name.
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

namespace mbsopt {

// arguments: the command, then its file and options. Results go into the folder of the run and onto standard output;
// what is wrong is said on standard error. Returns the exit code: 0 done, 1 a numerical failure, 2 bad input, 3 a check
// that did not hold, 130 interrupted.
int run_program(const std::vector<std::string>& arguments, const NamedTerms& terms = {});

}  // namespace mbsopt
