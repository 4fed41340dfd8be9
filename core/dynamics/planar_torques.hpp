// Torques of a planar model about its hinges, and free ones, from the frames of the plane alone:
//   x = sign arg(conj(A1 s1) A2 s2),   xdot = sign (omega2 - omega1),   omega = Im(Adot/A)      (joint_effort.hpp)
//   moments: sign f on body 1, -sign f on body 2 for a law f(x, xdot); |A| c_n for a free torque c (force_terms.hpp)
// These are the numbers of space, off the constraints, too, at a fraction of the work.
#pragma once

#include <vector>

#include "core/body/planar_frame.hpp"
#include "core/dynamics/force_terms.hpp"
#include "core/force/forces.hpp"

namespace mbsopt {

class PlanarTorques {
 public:
  using Frames = std::vector<PlanarFrame<double>>;
  explicit PlanarTorques(const MechanismData& data);  // with a planar model

  // Returns whether the vectors between which the hinges measure their angles lie in the plane.
  bool lie_in_plane() const { return lie_in_plane_; }
  // Returns whether no other force but springs acts, and no parameter turns these vectors.
  bool are_all() const { return are_all_; }

  // visitor(torque, law at these frames with its derivatives)
  template <class Visitor>
  void for_each_hinge(const ForceTerms::At& at, const Frames& frames, Law::Scratch& scratch, Visitor&& visitor) const {
    for_each([&](const auto& torque, const Hinge& hinge) {
      const auto [x, xdot] = measured(hinge, torque.angle, at.angles, frames);
      visitor(torque, torque.law.derivatives(at.t, data_.rho, x, xdot, scratch));
    });
  }

  // Where they are all; loads: body k at k - 1; load_dirs: the same in directions of parameters and fields.
  void add_loads(const ForceTerms::At& at, const Frames& frames, ForceTerms& forces, std::vector<Vec<3>>& loads) const;
  void add_field_tangent(const ForceTerms::At& at, const Frames& frames, ForceTerms& forces,
                         const ParameterBlock& block, std::vector<Lanes<3>>& load_dirs) const;

 private:
  struct Hinge {
    std::size_t body1, body2;
    Plane s1, s2;
    double sign;  // about +n or -n
  };
  Law::Point measured(const Hinge& hinge, int angle, const Eigen::VectorXd& angles, const Frames& frames) const;
  // visitor(torque, its hinge)
  template <class Visitor>
  void for_each(Visitor&& visitor) const {
    std::size_t i = 0;
    for (const RsdaForce& torque : data_.forces->of<RsdaForce>()) visitor(torque, hinges_[i++]);
    for (const TurningFriction& torque : data_.forces->of<TurningFriction>()) visitor(torque, hinges_[i++]);
  }

  const MechanismData& data_;
  std::vector<Hinge> hinges_;
  bool lie_in_plane_ = true, are_all_ = true;
};

}  // namespace mbsopt
