#include "app/command.hpp"
#include "app/exit_code.hpp"
#include "app/json/schema.hpp"

namespace mbsopt {

int schema_command(const CommandContext& context) {
  context.out << problem_schema_text();
  return kDone;
}

}  // namespace mbsopt
