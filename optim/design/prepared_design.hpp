// All searches of a design share its checked problem, the evaluator, the scaling and the start.
//
//   PreparedDesign prepared(problem, options, go_on);
//   DesignProgram program(prepared.spec, prepared.evaluator, prepared.scaling, prepared.objective());
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "optim/design/design_options.hpp"
#include "optim/objective/case_evaluator.hpp"
#include "optim/objective/case_objective.hpp"
#include "optim/problem/problem.hpp"
#include "optim/problem/variable_scaling.hpp"

namespace mbsopt::inline optim {

struct PreparedDesign {
  // Throws std::invalid_argument if problem.design makes no sense. progress: of each simulation.
  PreparedDesign(const Problem& given, const DesignOptions& options, std::function<bool(double t)> progress);

  CaseObjective objective() const { return {problem.cases, spec}; }

  const Problem problem;
  DesignSpec spec;  // with the sharpness of the maximum over cases
  CaseEvaluator evaluator;
  const VariableScaling scaling;
  const Eigen::VectorXd x_start;

 private:
  std::optional<double> sharpness();
  Eigen::VectorXd felt_changes();
};

std::vector<Parameter> chosen(const Scene& scene, const std::vector<int>& indices);
std::vector<std::string> objective_names(const DesignSpec& spec);  // what is minimised, then what is bounded

}  // namespace mbsopt::inline optim
