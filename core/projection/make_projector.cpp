#include "core/projection/mass_orthogonal_projection.hpp"
#include "core/projection/projection_derivatives.hpp"
#include "core/projection/square_projection.hpp"

namespace mbsopt {

ProjectionSolution Projector::solution() const {
  ProjectionSolution s;
  const std::size_t n = active() ? at(data_.n) : 0;
  s.delta.assign(n, Vec<6>::Zero());
  s.u.assign(n, Vec<6>::Zero());
  s.nu.setZero(active() ? data_.m : 0);
  s.kappa.setZero(active() ? data_.m : 0);
  return s;
}

std::unique_ptr<Projector> make_projector(const Mechanism& mechanism, Projection what, Model model, Free free) {
  if (model == Model::planar) return std::make_unique<ProjectorOf<BodyInPlane>>(mechanism, what, free);
  return std::make_unique<ProjectorOf<BodyInSpace>>(mechanism, what, free);
}

}  // namespace mbsopt
