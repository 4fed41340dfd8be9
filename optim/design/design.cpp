#include "optim/design/design.hpp"

#include <algorithm>

#include "core/driven/driven_simulation.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/scene/scene_error.hpp"
#include "optim/design/closing.hpp"
#include "optim/design/design_description.hpp"
#include "optim/design/design_program.hpp"
#include "optim/design/design_search.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {
namespace {

// The problem with a start at which its linkage closes, where it does not at the given one and such a start is found.
Problem closed(const Problem& given, const DesignOptions& options, int& steps) {
  try {
    const std::vector<bool> none(given.scene.parameters.size(), false);
    if (!may_be_solved(Mechanism(given.scene, parameter_values(given.scene), none), given.scene.simulation))
      return given;
  } catch (const SceneError&) {  // a field is out of its range here: the first evaluation says so
    return given;
  }
  bool abandoned = false;
  const auto go_on = [&] {
    abandoned =
        abandoned || (options.simulation_progress && !options.simulation_progress(given.scene.simulation.start_time));
    return !abandoned;
  };
  const DesignProgram program(given, options);
  const ClosedStart start = close_start(program, go_on);
  steps = start.closes ? start.steps : 0;
  if (steps == 0) return given;
  Problem problem = given;
  const Eigen::VectorXd rho = program.rho_at(start.x);
  for (const int k : program.evaluator().variables())
    problem.scene.parameters[static_cast<std::size_t>(k)].value = rho(k);
  return problem;
}

}  // namespace

std::optional<double> design_sharpness(const Problem& problem, const DesignOptions& options) {
  return DesignProgram(problem, options).spec().sharpness;
}

DesignResult given_design(const Problem& problem) {
  DesignProgram program(problem);
  DesignResult result;
  describe_start(program, program.evaluator().values(program.evaluator().start()), result);
  return result;
}

NlpScale design_scale(const Problem& problem, const DesignOptions& options) {
  DesignProgram program(problem, options);
  program.start_from(program.x_start());
  return program.scale();
}

int design_modes(const Problem& problem, const DesignOptions& options) {
  return static_cast<int>(modes_at(problem.scene, options).modes.size());
}

std::optional<Problem> problem_that_closes(const Problem& problem, const DesignOptions& options) {
  int steps = 0;
  Problem found = closed(problem, options, steps);
  if (steps == 0) return {};
  return found;
}

DesignResult run_design(const Problem& given, const DesignOptions& options) {
  int steps = 0;
  const Problem problem = closed(given, options, steps);
  DesignResult result = options.mode ? design_in_mode(problem, options) : single_design(problem, options);
  result.closing_steps = steps;
  if (steps > 0)
    for (DesignVariable& v : result.variables)
      v.initial = std::ranges::find(given.scene.parameters, v.name, &Parameter::name)->value;
  return result;
}

}  // namespace mbsopt::inline optim
