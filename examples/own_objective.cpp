// An objective written in C++ in the problem of a file, minimised by Ipopt: the rod comes to the vertical at the end.
#include <cstdio>
#include <mbsopt/mbsopt.hpp>

#include "drag.hpp"

struct Hangs final : mbsopt::TerminalCost {  // x^2 + (0.1 xdot)^2 of the centre of mass
  double value(mbsopt::VecIn y, mbsopt::VecIn) const override { return y(0) * y(0) + 0.01 * y(7) * y(7); }
  void adjoint_init(mbsopt::VecIn y, mbsopt::VecIn, mbsopt::VecOut lambda, mbsopt::VecOut) const override {
    lambda(0) = 2 * y(0), lambda(7) = 0.02 * y(7);
  }
};

int main(int, char** argv) {
  mbsopt::Problem problem = mbsopt::read_problem(argv[1]);
  mbsopt::ObjectiveSpec hangs;
  hangs.name = "hangs", hangs.terminal_in_cpp = std::make_shared<Hangs>();
  problem.objectives.push_back(hangs);
  mbsopt::DesignSpec design;
  design.minimize = "hangs", design.variables = {"L", "drag"};
  problem.design = design;
  mbsopt::DesignOptions options;
  options.user_forces = {std::make_shared<Drag>()};
  const mbsopt::DesignResult result = mbsopt::run_design(problem, options);
  std::printf("%s: %.6f to %.6f\n", result.message.c_str(), result.objective_initial, result.objective_final);
  for (const mbsopt::DesignVariable& v : result.variables) std::printf("%s = %.6f\n", v.name.c_str(), v.value);
  return result.ok() && result.objective_final < 0.1 * result.objective_initial ? 0 : 1;
}
