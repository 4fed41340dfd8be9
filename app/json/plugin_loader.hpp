// Loads plug-ins (optim/problem/plugin.hpp).
#pragma once

#include <filesystem>

#include "optim/problem/named_terms.hpp"

namespace mbsopt {

// Adds the terms of a shared library, which stays loaded until the process ends: objects of its classes may. Throws
// std::runtime_error in words: no such file, no library, no plug-in, compiled otherwise, terms refused, or what its
// registration threw.
void load_plugin(const std::filesystem::path& file, NamedTerms& terms);

}  // namespace mbsopt
