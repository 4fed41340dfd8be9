// Load cases: several problems that one design must satisfy. A case is a problem of its own, with the same objectives
// and the same parameters in the same order. So every function of a problem also takes a case.
//
// An override makes a parameter p = e(rho) in this case: its scene has a definition p = e, and the parameter itself has
// another name there. So the chain of all definitions gives exact derivatives in the parameters of the problem.
//
//   "cases": [{"name": "cold", "overrides": {"k1": "1.2*k1"}, "end_time": 2}]
//
//   const Problem cold = problem_of(problem, problem.cases[0]);
#pragma once

#include <string>
#include <vector>

#include "optim/problem/problem.hpp"

namespace mbsopt::inline optim {

// Returns the case without the cases and the identification. Its design has the same variables, under their names in
// the case.
Problem problem_of(const Problem& problem, const CaseSpec& load_case);

// The name of a parameter of the problem in a case.
std::string name_in(const CaseSpec& load_case, const std::string& parameter, const Scene& scene);

// Replaces the case's names of parameters in words by those of the problem.
std::string in_names_of_problem(std::string words, const CaseSpec& load_case, const Scene& scene);

// The problems of all cases, or the problem itself without cases.
std::vector<Problem> problems_of_cases(const Problem& problem);

}  // namespace mbsopt::inline optim
