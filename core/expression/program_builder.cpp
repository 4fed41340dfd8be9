#include "core/expression/program_builder.hpp"

namespace mbsopt {

Program::Program(const Expression& expression, const Symbols& symbols) {
  ProgramBuilder(symbols, *this).build(expression);
}

}  // namespace mbsopt
