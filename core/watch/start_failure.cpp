#include "core/watch/start_failure.hpp"

#include <fmt/format.h>

#include "core/linear/dense.hpp"

namespace mbsopt {
namespace {

std::string bodies_without_inertia(const MechanismData& d) {
  std::string names;
  for (int i = 1; i <= d.n; ++i) {
    const BodyData& b = d.bodies[static_cast<std::size_t>(i)];
    const double least = symmetric_eigenvalues(b.J)(0);
    if (b.mass > 0 && least > 0) continue;
    names += (names.empty() ? "'" : ", '") + d.body_names[static_cast<std::size_t>(i)] + "'";
  }
  return names;
}

}  // namespace

std::string start_failure(const MechanismData& data, double t) {
  const std::string bodies = bodies_without_inertia(data);
  return fmt::format("the accelerations at the start, t = {:.6g} s, cannot be computed. ", t) +
         (bodies.empty()
              ? "A force or law is not finite there (a root, logarithm or division outside its range?): look "
                "at the laws of forces and drives and at the sensors in them"
              : "A body without mass or inertia in a direction that no joint holds has none: " + bodies +
                    ". Give it some, or hold it");
}

}  // namespace mbsopt
