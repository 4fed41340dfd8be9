// Writes a whole text to a descriptor, also if the system takes it in parts or a signal interrupts it.
#pragma once

#include <string_view>

namespace mbsopt::inline optim {

bool write_all(int descriptor, std::string_view text);  // false: errno says why

}  // namespace mbsopt::inline optim
