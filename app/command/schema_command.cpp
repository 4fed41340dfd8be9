#include "app/json/schema.hpp"
#include "app/run/command.hpp"
#include "app/terminal/exit_code.hpp"

namespace mbsopt::inline app {

int schema_command(const CommandContext& context) {
  context.out << problem_schema_text();
  return kDone;
}

}  // namespace mbsopt::inline app
