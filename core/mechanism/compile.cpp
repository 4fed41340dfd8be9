#include <algorithm>

#include "core/constraint/constraint.hpp"
#include "core/linear/dense.hpp"
#include "core/mechanism/compilation.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/mechanism/rounded_loops.hpp"
#include "core/scene/scene_error.hpp"

namespace mbsopt {
namespace {

void group_rows(MechanismData& data) {
  std::vector<int> terms(at(data.m), 0);
  for (const Constraint& c : data.constraints) ++terms[at(c.row)];
  for (Constraint& c : data.constraints) {
    c.block = data.blocks;
    data.blocks += c.rows();
    const bool shared = terms[at(c.row)] > 1;
    const RowGroup* last = data.groups.empty() ? nullptr : &data.groups.back();
    if (!last || shared || last->shared || last->body1 != c.body1 || last->body2 != c.body2) {
      data.groups.push_back({c.body1, c.body2, c.row, c.block, 0, shared});
    }
    data.groups.back().rows += c.rows();
  }
}

// The masses of bodies, or their inertias, as the rows of two of them see it. A body without mass transmits the forces
// of a row to the bodies that it carries. The row then sees the other body, or else the lightest of all.
class SeenInertia {
 public:
  explicit SeenInertia(const std::vector<double>& of_bodies) : of_bodies_(of_bodies) {
    constexpr double kLeast = 1e-6;  // of the largest: keeps S = M + alpha J'J well scaled
    const double most = std::ranges::max(of_bodies), largest = most > 0 ? most : 1;
    least_ = kLeast * largest;
    lightest_ = largest;
    for (const double here : of_bodies)
      if (here > 0) lightest_ = std::min(lightest_, here);
    lightest_ = std::max(lightest_, least_);
  }
  double inverse(const Constraint& c) const {
    double sum = 0;
    for (const int body : {c.body1, c.body2})
      if (of_bodies_[at(body)] > 0) sum += 1 / std::max(of_bodies_[at(body)], least_);
    return sum > 0 ? sum : 1 / lightest_;
  }

 private:
  std::vector<double> of_bodies_;
  double least_, lightest_;
};

// The inertia that a row sees, independent of the configuration. For a point or distance it is the reduced mass of the
// two bodies. For a direction or angle it is the reduced inertia about the body's farthest joint point. For an Euler
// parameter it is four times that (p' = 1/2 G'omega). The inverses of several terms add up with their factors squared.
void scale_alpha(MechanismData& data) {
  std::vector<double> masses, inertias, reach2(data.bodies.size(), 0.0);
  for (const Constraint& c : data.constraints)
    c.for_each_point(
        [&](int body, const Vector3d& s) { reach2[at(body)] = std::max(reach2[at(body)], s.squaredNorm()); });
  for (std::size_t i = 0; i < data.bodies.size(); ++i) {
    const BodyData& b = data.bodies[i];
    masses.push_back(b.mass);
    inertias.push_back(i == 0 ? 0 : symmetric_eigenvalues(b.J)(2) + b.mass * reach2[i]);
  }
  const SeenInertia mass(masses), inertia(inertias);
  data.row_alpha.setZero(data.m);
  for (const Constraint& c : data.constraints) {
    const RowQuantity quantity = c.quantity();
    const double seen = (quantity == RowQuantity::length ? mass : inertia).inverse(c);
    data.row_alpha.segment(c.row, c.rows()).array() +=
        c.factor * c.factor * seen * (quantity == RowQuantity::euler_parameter ? 0.25 : 1.0);
  }
  const double length = joint_lengths(data).whole;
  data.row_size.setOnes(data.m);
  for (const Constraint& c : data.constraints)
    if (c.quantity() == RowQuantity::length) data.row_size.segment(c.row, c.rows()).setConstant(length);
  // A factor of zero leaves a row without inertia; any alpha is then right.
  data.row_alpha = (data.row_alpha.array() > 0).select(data.row_alpha.array().inverse(), 1.0);
}

}  // namespace

MechanismData compile(const Scene& scene, const Eigen::VectorXd& rho, const std::vector<bool>& active,
                      std::vector<std::shared_ptr<const UserForce>> user_forces,
                      std::shared_ptr<ScenePrograms> programs) {
  if (rho.size() != static_cast<Eigen::Index>(scene.parameters.size())) {
    throw SceneError("parameters: " + std::to_string(rho.size()) + " values were given for " +
                     std::to_string(scene.parameters.size()) + " parameters");
  }
  if (!active.empty() && active.size() != scene.parameters.size()) {
    throw SceneError("active: " + std::to_string(active.size()) + " flags were given for " +
                     std::to_string(scene.parameters.size()) + " parameters");
  }
  Compilation model(scene, rho, active, programs ? std::move(programs) : std::make_shared<ScenePrograms>(scene));
  compile_signals(model);
  compile_bodies(model);
  compile_joints(model);
  compile_drives(model);
  compile_forces(model);
  compile_user_forces(model, std::move(user_forces));
  compile_sensors(model);
  compile_limits(model);
  compile_conditions(model);
  model.data.equilibrium = scene.equilibrium;
  model.data.assembly_iterations = scene.assembly_iterations;
  group_rows(model.data);
  scale_alpha(model.data);
  model.data.theta_rho = model.fields.theta_rho();
  find_planar_model(scene, model.data);
  close_rounded_loops(model.data, scene.simulation.redundancy_tolerance, model.fields.programs().independent_loops);
  if (model.data.rounded.made) find_planar_model(scene, model.data);
  return std::move(model.data);
}

}  // namespace mbsopt
