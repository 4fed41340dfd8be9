// These options give the C++ terms that a problem file may call.
#pragma once

#include "optim/problem/named_terms.hpp"

namespace mbsopt::inline app {

struct ReadOptions {
  NamedTerms terms = {};       // in C++, which the file may call by name
  bool allow_plugins = false;  // whether the shared libraries that it names are loaded, which run code of their own
};

}  // namespace mbsopt::inline app
