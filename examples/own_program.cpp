// mbsopt's commands in a program of your own, for files that call its terms by name: a design from several starts, with
// its journal, statistics and report.
#include <mbsopt/program.hpp>

#include "terms.hpp"

int main(int argc, char** argv) {
  mbsopt::NamedTerms terms;
  add_terms(terms);
  return mbsopt::run_program({argv + 1, argv + argc}, terms);
}
