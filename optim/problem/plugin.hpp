// A plug-in: a shared library with forces, costs and laws that problem files call by name (docs/plug-ins.md). It is
// compiled with this package's headers alone and records their version. A plug-in of another version is refused.
//
//   #include <mbsopt/plugin.hpp>
//   MBSOPT_PLUGIN(terms) { terms.add_force("drag", {"c"}, std::make_shared<Drag>()); }
//
//   "plugins": ["./libdrag.so"]                                      // mbsopt simulate problem.json --allow-plugins
#pragma once

#include <Eigen/Core>

#include "optim/problem/named_terms.hpp"

#define MBSOPT_TEXT_OF(x) #x
#define MBSOPT_TEXT(x) MBSOPT_TEXT_OF(x)

namespace mbsopt::inline optim {

// The layout of passed objects depends on the classes of this version, the compiler's ABI, and the alignment of Eigen's
// vectors. -march changes the last one.
inline constexpr const char* kPluginInterface =
    "mbsopt 0.2, ABI " MBSOPT_TEXT(__GXX_ABI_VERSION) ", Eigen " MBSOPT_TEXT(EIGEN_WORLD_VERSION) "." MBSOPT_TEXT(
        EIGEN_MAJOR_VERSION) "." MBSOPT_TEXT(EIGEN_MINOR_VERSION) " aligned to " MBSOPT_TEXT(EIGEN_MAX_ALIGN_BYTES);

}  // namespace mbsopt::inline optim

#define MBSOPT_PLUGIN(terms)                                                            \
  extern "C" const char* mbsopt_plugin_interface() { return mbsopt::kPluginInterface; } \
  extern "C" void mbsopt_plugin(mbsopt::NamedTerms& terms)
