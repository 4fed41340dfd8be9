// Loads plug-ins (optim/problem/plugin.hpp).
#pragma once

#include <filesystem>

#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

// Adds the terms of a shared library. The library stays loaded until the process ends, because objects of its classes
// may live so long. Throws std::runtime_error in words: no such file, no library, no plug-in, another version, refused
// terms, or an exception of its registration.
void load_plugin(const std::filesystem::path& file, NamedTerms& terms);

}  // namespace mbsopt::inline app
