// Load cases: several problems that one design must bear. A case is a problem of its own, with the same objectives and
// the same parameters in the same order, so that everything that is computed of a problem is computed of a case.
//
// An override makes a parameter p = e(rho) in this case: its scene has a definition p = e, and the parameter itself is
// called otherwise there. So derivatives in the parameters of the problem are exact by the chain of all definitions.
//
//   "cases": [{"name": "cold", "overrides": {"k1": "1.2*k1"}, "end_time": 2}]
//
//   const Problem cold = problem_of(problem, problem.cases[0]);
#pragma once

#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt {

// Without the cases and the identification. Its design has the same variables, under their names in the case.
Problem problem_of(const Problem& problem, const CaseSpec& load_case);

// What a parameter of the problem is called in a case.
std::string name_in(const CaseSpec& load_case, const std::string& parameter, const Scene& scene);

// The words with the problem's names of parameters in place of those that they have in the case.
std::string in_names_of_problem(std::string words, const CaseSpec& load_case, const Scene& scene);

// The problems of all cases; the problem itself where it has none.
std::vector<Problem> problems_of_cases(const Problem& problem);

}  // namespace mbsopt
