#include "core/expression/operation.hpp"

namespace mbsopt {

int operands(Operation operation) {
  switch (operation) {
    case Operation::number:
    case Operation::name:
      return 0;
    case Operation::add:
    case Operation::subtract:
    case Operation::multiply:
    case Operation::divide:
    case Operation::power:
    case Operation::atan2:
    case Operation::min:
    case Operation::max:
    case Operation::smooth_abs:
    case Operation::not_above:
      return 2;
    default:
      return 1;
  }
}

const FunctionEntry* find_function(std::string_view name) {
  for (const FunctionEntry& entry : kFunctions)
    if (entry.name == name) return &entry;
  return nullptr;
}

}  // namespace mbsopt
