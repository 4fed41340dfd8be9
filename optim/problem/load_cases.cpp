#include "optim/problem/load_cases.hpp"

#include <algorithm>
#include <functional>
#include <string>

#include "core/expression/syntax_tree.hpp"

namespace mbsopt::inline optim {
namespace {

bool is_overridden(const CaseSpec& load_case, const std::string& parameter) {
  return std::ranges::find(load_case.overrides, parameter, &Definition::name) != load_case.overrides.end();
}

bool is_taken(const Scene& scene, const std::string& name) {
  const auto has = [&](const auto& list, auto member) { return std::ranges::find(list, name, member) != list.end(); };
  return has(scene.parameters, &Parameter::name) || has(scene.definitions, &Definition::name) ||
         has(scene.sensors, &Sensor::name);
}

// The expression with the names that parameters have in the case.
Expression in_case(const Expression& e, const CaseSpec& load_case, const Scene& scene) {
  if (e.is_number()) return e;
  std::string text = e.text();
  std::vector<const SyntaxNode*> names;
  for (const SyntaxNode& node : e.tree().nodes)
    if (node.operation == Operation::name && is_overridden(load_case, node.name)) names.push_back(&node);
  std::ranges::sort(names, std::greater(), &SyntaxNode::offset);  // from the end, so that offsets stay right
  for (const SyntaxNode* const node : names)
    text.replace(node->offset, node->name.size(), name_in(load_case, node->name, scene));
  return Expression::parse(text);
}

}  // namespace

std::string name_in(const CaseSpec& load_case, const std::string& parameter, const Scene& scene) {
  if (!is_overridden(load_case, parameter)) return parameter;
  std::string name = parameter + "_of_problem";
  while (is_taken(scene, name)) name += "_";
  return name;
}

std::string in_names_of_problem(std::string words, const CaseSpec& load_case, const Scene& scene) {
  for (const Definition& override : load_case.overrides) {
    const std::string name = name_in(load_case, override.name, scene);
    for (std::size_t at = 0; (at = words.find(name, at)) != std::string::npos; at += override.name.size())
      words.replace(at, name.size(), override.name);
  }
  return words;
}

Problem problem_of(const Problem& problem, const CaseSpec& load_case) {
  Problem result = problem;
  result.cases.clear();
  result.identification.reset();
  Scene& scene = result.scene;
  for (Parameter& p : scene.parameters) p.name = name_in(load_case, p.name, problem.scene);
  for (const Definition& override : load_case.overrides)
    scene.definitions.push_back({override.name, in_case(override.value, load_case, problem.scene)});
  if (result.design)
    for (std::string& variable : result.design->variables) variable = name_in(load_case, variable, problem.scene);
  for (const DriveLaw& law : load_case.drives) {
    const auto drive = std::ranges::find(scene.drives, law.drive, &Drive::name);
    if (drive != scene.drives.end()) {
      drive->law = law.law;
      drive->samples = law.samples;
    }
  }
  for (const SignalSamples& samples : load_case.signals) {
    const auto signal = std::ranges::find(scene.signals, samples.name, &Signal::name);
    if (signal != scene.signals.end()) static_cast<SampleColumn&>(*signal) = samples;
  }
  for (const Condition& condition : load_case.conditions) {
    const auto same = std::ranges::find(scene.conditions, condition.sensor, &Condition::sensor);
    if (same != scene.conditions.end())
      *same = condition;
    else
      scene.conditions.push_back(condition);
  }
  if (load_case.end_time) scene.simulation.end_time = *load_case.end_time;
  return result;
}

std::vector<Problem> problems_of_cases(const Problem& problem) {
  if (problem.cases.empty()) return {problem};
  std::vector<Problem> problems;
  for (const CaseSpec& load_case : problem.cases) problems.push_back(problem_of(problem, load_case));
  return problems;
}

}  // namespace mbsopt::inline optim
