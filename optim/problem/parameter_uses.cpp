#include "optim/problem/parameter_uses.hpp"

#include "core/scene/field_visitor.hpp"
#include "core/scene/scene_facts.hpp"
#include "optim/problem/problem_vocabulary.hpp"

namespace mbsopt::inline optim {

std::vector<ParameterUse> parameter_uses(const Problem& problem) {
  const SceneFacts facts(problem.scene);
  std::vector<ParameterUse> uses;
  for (const Parameter& p : problem.scene.parameters) uses.push_back({p.name, {}});
  auto on_expression = [&](const FieldPlace& at, const Expression& expression, Scope names) {
    if (expression.is_number()) return;
    const Symbols& symbols = facts.symbols(names);
    const Program program(expression, symbols);
    for (const int input : program.used_inputs()) {
      if (input < static_cast<int>(uses.size())) uses[static_cast<std::size_t>(input)].fields.push_back(at.path);
    }
  };
  FieldVisitor visitor(on_expression, [](const std::string&, const std::string&) {});
  describe(visitor, problem);
  return uses;
}

}  // namespace mbsopt::inline optim
