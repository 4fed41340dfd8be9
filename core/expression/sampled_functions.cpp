#include "core/expression/sampled_functions.hpp"

#include <map>

#include "core/expression/program_builder.hpp"

namespace mbsopt {

std::vector<SampledFunction> ProgramBuilder::sampled_functions_of(const Program& program) {
  std::vector<SampledFunction> found;
  const Symbols none;
  std::map<int, Program> arguments;  // many functions have the same: those of parameters at the samples
  for (const Instruction& in : program.code_) {
    if (in.operation != Operation::curve) continue;
    const auto& [curve, order] = program.curve_of(in);
    const auto [argument, is_new] = arguments.try_emplace(in.a);
    if (is_new) ProgramBuilder(none, argument->second).build_switch(program, Operation::name, in.a, -1);
    found.push_back({curve, order, argument->second});
  }
  return found;
}

std::vector<SampledFunction> sampled_functions_of(const Program& program) {
  return ProgramBuilder::sampled_functions_of(program);
}

}  // namespace mbsopt
