// The exception for a scene that cannot be compiled.
#pragma once

#include <stdexcept>

namespace mbsopt {

// Its text begins with the place in the scene: "bodies[2].inertia: must be symmetric".
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace mbsopt
