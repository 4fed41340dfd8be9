#include "core/mechanism/compile.hpp"

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
  std::vector<int> terms(static_cast<std::size_t>(data.m), 0);
  for (const Constraint& c : data.constraints) ++terms[static_cast<std::size_t>(c.row)];
  for (Constraint& c : data.constraints) {
    c.block = data.blocks;
    data.blocks += c.rows();
    const bool shared = terms[static_cast<std::size_t>(c.row)] > 1;
    const RowGroup* last = data.groups.empty() ? nullptr : &data.groups.back();
    if (!last || shared || last->shared || last->body1 != c.body1 || last->body2 != c.body2) {
      data.groups.push_back({c.body1, c.body2, c.row, c.block, 0, shared});
    }
    data.groups.back().rows += c.rows();
  }
}

// The inertia that a row sees, independent of the configuration. For a point or distance it is the reduced mass of the
// two bodies. For a direction or angle it is the reduced inertia about the body's farthest joint point. For an Euler
// parameter it is four times that (p' = 1/2 G'omega). The inverses of several terms add up with their factors squared.
// A body without mass transmits the forces of a row to the bodies that it carries. The row then sees the other body, or
// else the lightest of all.
void scale_alpha(MechanismData& data) {
  const std::size_t bodies = data.bodies.size();
  std::vector<double> mass(bodies), inertia(bodies), reach2(bodies, 0.0);
  double largest_mass = 0, largest_inertia = 0;
  for (const Constraint& c : data.constraints) {
    c.for_each_point([&](int body, const Vector3d& s) {
      double& r2 = reach2[static_cast<std::size_t>(body)];
      r2 = std::max(r2, s.squaredNorm());
    });
  }
  for (std::size_t i = 1; i < bodies; ++i) {
    const BodyData& b = data.bodies[i];
    mass[i] = b.mass;
    inertia[i] = symmetric_eigenvalues(b.J)(2) + b.mass * reach2[i];
    largest_mass = std::max(largest_mass, mass[i]);
    largest_inertia = std::max(largest_inertia, inertia[i]);
  }
  if (largest_mass == 0) largest_mass = 1;
  if (largest_inertia == 0) largest_inertia = 1;
  static constexpr double kLeast = 1e-6;  // of the largest: keeps S = M + alpha J'J well scaled
  const auto lightest = [](const std::vector<double>& x, double largest) {
    double least = largest;
    for (const double here : x) {
      if (here > 0) least = std::min(least, here);
    }
    return std::max(least, kLeast * largest);
  };
  const double lightest_mass = lightest(mass, largest_mass), lightest_inertia = lightest(inertia, largest_inertia);
  const auto inverse = [](const std::vector<double>& x, double largest, double otherwise, const Constraint& c) {
    double sum = 0;
    for (const int body : {c.body1, c.body2}) {
      const double here = x[static_cast<std::size_t>(body)];
      if (here > 0) sum += 1 / std::max(here, kLeast * largest);
    }
    return sum > 0 ? sum : 1 / otherwise;
  };
  data.row_alpha.setZero(data.m);
  for (const Constraint& c : data.constraints) {
    const RowQuantity quantity = c.quantity();
    const double seen = quantity == RowQuantity::length ? inverse(mass, largest_mass, lightest_mass, c)
                                                        : inverse(inertia, largest_inertia, lightest_inertia, c);
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
  compile_conditions(model);
  model.data.equilibrium = scene.equilibrium;
  model.data.assembly_iterations = scene.assembly_iterations;
  group_rows(model.data);
  scale_alpha(model.data);
  model.data.theta_rho = model.fields.theta_rho();
  const auto find_plane = [&] {
    PlanarSearch plane = find_planar_model(scene, model.data);
    model.data.planar = std::move(plane.model);
    model.data.not_planar = std::move(plane.reason);
  };
  find_plane();
  close_rounded_loops(model.data, scene.simulation.redundancy_tolerance, model.fields.programs().independent_loops);
  if (model.data.rounded.made) find_plane();
  return std::move(model.data);
}

}  // namespace mbsopt
