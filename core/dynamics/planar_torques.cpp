#include "core/dynamics/planar_torques.hpp"

#include <algorithm>
#include <cmath>

#include "core/mechanism/planar_model.hpp"

namespace mbsopt {
namespace {

double rate_of_turn(const PlanarFrame<double>& f) { return (conj(f.A) * f.Adot).im / squared_norm(f.A); }

}  // namespace

PlanarTorques::PlanarTorques(const MechanismData& data) : data_(data) {
  constexpr double kParallel = 1e-12;  // sine of the angle up to which a direction counts as another
  const PlanarModel& model = *data.planar;
  const auto add = [&](const auto& torque) {
    const JointAngle& joint = torque.joint;
    const Angle& measure = joint.measure;
    const PlanarBody &body1 = model.bodies[at(joint.body1)], &body2 = model.bodies[at(joint.body2)];
    const auto lies = [](const PlanarBody& body, const Vector3d& s) {
      return std::abs(body.n.dot(s)) <= kParallel * s.norm();
    };
    const Plane s1 = body1.in_plane(measure.s1), s3 = body1.in_plane(measure.s3);
    const double sign = (conj(s1) * s3).im > 0 ? 1 : -1;
    const Plane off = s3 - sign * times_i(s1);
    lie_in_plane_ = lie_in_plane_ && lies(body1, measure.s1) && lies(body1, measure.s3) && lies(body2, measure.s2) &&
                    squared_norm(off) <= kParallel * kParallel * squared_norm(s1);
    are_all_ = are_all_ && joint.slot1 < 0 && joint.slot2 < 0 && joint.slot3 < 0;
    hinges_.push_back({at(joint.body1), at(joint.body2), s1, body2.in_plane(measure.s2), sign});
  };
  std::ranges::for_each(data.forces->of<RsdaForce>(), add);
  std::ranges::for_each(data.forces->of<TurningFriction>(), add);
  are_all_ = are_all_ && lie_in_plane_ && data.user_forces.empty() &&
             data.forces->size() == hinges_.size() + data.forces->of<TsdaForce>().size() &&
             std::ranges::all_of(data.applied, ForceTerms::is_free_torque);
}

Law::Point PlanarTorques::measured(const Hinge& hinge, int angle, const Eigen::VectorXd& angles,
                                   const Frames& frames) const {
  const PlanarFrame<double>&f1 = frames[hinge.body1], &f2 = frames[hinge.body2];
  const Plane z = conj(f1.A * hinge.s1) * (f2.A * hinge.s2);
  return {Angle::on_branch(hinge.sign * std::atan2(z.im, z.re), branch(angles, angle)),
          hinge.sign * (rate_of_turn(f2) - rate_of_turn(f1))};
}

void PlanarTorques::add_loads(const ForceTerms::At& at, const Frames& frames, ForceTerms& forces,
                              std::vector<Vec<3>>& loads) const {
  for_each([&](const auto& torque, const Hinge& hinge) {
    const auto [x, xdot] = measured(hinge, torque.angle, at.angles, frames);
    const double moment = hinge.sign * torque.law.value(at.t, data_.rho, x, xdot, forces.law_scratch());
    if (hinge.body1 > 0) loads[hinge.body1 - 1](2) += moment;
    if (hinge.body2 > 0) loads[hinge.body2 - 1](2) -= moment;
  });
  forces.for_each_free_torque(at, [&](std::size_t body, const Vector3d& c) {
    loads[body - 1](2) += std::sqrt(squared_norm(frames[body].A)) * c(data_.planar->n);
  });
}

void PlanarTorques::add_field_tangent(const ForceTerms::At& at, const Frames& frames, ForceTerms& forces,
                                      const ParameterBlock& block, std::vector<Lanes<3>>& load_dirs) const {
  for_each([&](const auto& torque, const Hinge& hinge) {
    if (!torque.law.moves(block)) return;
    constexpr int kFields = std::decay_t<decltype(torque.law)>::kFields;
    const Law::Point point = measured(hinge, torque.angle, at.angles, frames);
    torque.law.derivatives(at.t, data_.rho, point.x, point.xdot, forces.law_scratch());  // of a program
    Lanes<kFields> fields;
    const Lanes<1> moment = hinge.sign * torque.law.field_tangent(
                                             point, block.field<kFields>(torque.law.slot, fields),
                                             [&](int k) { return block.direction(k); }, forces.law_scratch());
    if (hinge.body1 > 0) load_dirs[hinge.body1 - 1].row(2) += moment;
    if (hinge.body2 > 0) load_dirs[hinge.body2 - 1].row(2) -= moment;
  });
  forces.for_each_free_torque_tangent(at, block, [&](std::size_t body, const Lanes<3>& c) {
    load_dirs[body - 1].row(2) += std::sqrt(squared_norm(frames[body].A)) * c.row(data_.planar->n);
  });
}

}  // namespace mbsopt
