// The branches of a program. At abs, sign, min, max, and at samples of tables of the motion, a program takes one of two
// branches, by the sign of a decision: a of abs(a), a - b of max(a, b). Each branch alone is smooth.
//
//   const std::vector<Branching> branchings = branchings_of(law, parameters, time);
//   const Program beyond = with_branches(law, branchings, {1});    // of max(x - gap, 0): x - gap, for any x
#pragma once

#include <span>
#include <vector>

#include "core/expression/branching.hpp"

namespace mbsopt {

// The branchings whose decision depends on an input from `parameters` on. Tables of time alone are left out
// (kink_times.hpp), and so are those with many samples, which follow smooth functions, and poles and roots at the kink.
std::vector<Branching> branchings_of(const Program& program, int parameters, int time);

// The same program with a side, 1 or -1, of each branching's decision; with side 0 it stays as written. It has at most
// as many instructions. A branch that a root or a power reads has no values on its other side and stays as written.
Program with_branches(const Program& program, std::span<const Branching> branchings, std::span<const int> sides);

Program negative_of(const Program& program);

}  // namespace mbsopt
