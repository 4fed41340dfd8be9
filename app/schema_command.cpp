#include <string_view>

#include "app/command.hpp"
#include "app/exit_code.hpp"

namespace mbsopt {

extern const std::string_view problem_schema;  // problems/problem.schema.json, embedded by the build

int schema_command(const CommandContext& context) {
  context.out << problem_schema;
  return kDone;
}

}  // namespace mbsopt
