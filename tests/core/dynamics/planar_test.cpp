// The planar model against the spatial one: the same numbers, at single states off the constraints and along motions,
// with their tangents and adjoints; and which scenes have one.
#include <catch2/catch.hpp>

#include "core/dynamics/dynamics.hpp"
#include "core/mechanism/planar_model.hpp"
#include "core/projection/projection.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/dynamics/planar_scenes.hpp"
#include "tests/core/integrate/state_costs.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kInstant = 0.37;

// The directions of y that stay in the plane, one per column: r, and P along p_a and p_b; their rates.
MatrixXd plane_of(const MechanismData& d) {
  const PlanarModel& m = *d.planar;
  MatrixXd basis = MatrixXd::Zero(14 * d.n, 8 * d.n);
  Eigen::Index column = 0;
  for (const int half : {0, 7 * d.n}) {
    for (int i = 1; i <= d.n; ++i) {
      const PlanarBody& b = m.bodies[static_cast<std::size_t>(i)];
      const Eigen::Index q = half + 7 * (i - 1);
      basis(q + m.t1, column++) = 1, basis(q + m.t2, column++) = 1;
      basis.block<4, 1>(q + 3, column++) = b.p_a, basis.block<4, 1>(q + 3, column++) = b.p_b;
    }
  }
  return basis;
}

// In the plane, off the constraints and off the unit sphere.
VectorXd state(const MechanismData& d, unsigned seed) {
  std::srand(seed);
  VectorXd guess = VectorXd::Zero(14 * d.n);
  for (int i = 1; i <= d.n; ++i) guess.segment<7>(7 * (i - 1)) = d.bodies[static_cast<std::size_t>(i)].q;
  const MatrixXd plane = plane_of(d);
  return guess + plane * (0.2 * VectorXd::Random(plane.cols()));
}

LaneRows directions(const MechanismData& d, unsigned seed) {
  std::srand(seed);
  const MatrixXd plane = plane_of(d);
  return plane * LaneRows::Random(plane.cols(), kLanes);
}

FormulationSettings formulation_of_type(const std::string& name) {
  FormulationSettings s;
  if (name == "stabilised") s.omega = 7, s.xi = 0.8;
  if (name == "penalty") s = FormulationSettings::penalty(), s.alpha = 1e4;
  return s;
}

double size_of(const MatrixXd& x) { return x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(); }
// Largest difference, relative to the largest entry.
double apart(const MatrixXd& x, const MatrixXd& y) { return size_of(x - y) / std::max(size_of(y), 1e-300); }

// Springs between moving bodies, whose points lie in the plane: of a law, with damping and free length, and k d.
void set_springs_in_plane(Scene& scene, int normal) {
  const auto spring = [&](const char* body1, const VectorField& point1, const char* body2, const VectorField& point2) {
    Tsda s;
    s.body1 = body1, s.point1 = point1, s.body2 = body2, s.point2 = point2;
    return s;
  };
  const auto at = [&](const char* a, const char* b) { return along(normal, a, b, "0"); };
  Tsda lawful = spring("crank", at("c1", "0.2"), "plate", at("-0.3", "edge"));
  lawful.law = f("k*(l - rest)^2 + mu*ldot^3 + 0.2*ldot*l");
  Tsda damped = spring("coupler", at("c2", "0.1"), "bar", at("q", "-0.2"));
  damped.stiffness = f("k"), damped.damping = 0.8, damped.free_length = f("rest");
  Tsda plain = spring("ground", at("px", "1"), "wheel", at("0.1", "0.2"));
  plain.stiffness = f("k");
  scene.forces = {{"lawful", lawful}, {"damped", damped}, {"plain", plain}};
}

// ydot' = (v', a')
LaneRows tangent(Dynamics& dynamics, const ParameterBlock& block, const LaneRows& y_dir) {
  LaneRows out(y_dir.rows(), kLanes);
  out.topRows(y_dir.rows() / 2) = y_dir.bottomRows(y_dir.rows() / 2);
  dynamics.acceleration_tangent(block, y_dir, out.bottomRows(y_dir.rows() / 2));
  return out;
}

}  // namespace

TEST_CASE("planar accelerations, their tangent and their adjoint are the spatial ones", "[planar]") {
  const std::string form = GENERATE(as<std::string>{}, "augmented_lagrangian", "stabilised", "penalty");
  const int normal = GENERATE(2, 0, 1);
  Scene scene = planar_machine(normal, form != "penalty");  // which gives way to loads across the plane
  enum class Acting { all, springs, torques, torques_of_known_hinges };
  const Acting forces = GENERATE(Acting::all, Acting::springs, Acting::torques, Acting::torques_of_known_hinges);
  if (forces == Acting::springs) set_springs_in_plane(scene, normal);
  if (forces == Acting::torques || forces == Acting::torques_of_known_hinges)
    std::erase_if(scene.forces, [](const Force& f) { return f.name == "spring" || f.name == "push"; });
  for (Joint& joint : scene.joints) {  // whose angles no parameter shifts; one is about -n
    if (forces != Acting::torques_of_known_hinges || joint.type != "revolute") continue;
    joint.normal2 = joint.normal1;
    if (joint.name == "E") joint.axis1 = joint.axis2 = along(normal, "0", "0", "-1");
  }
  for (Force& force : scene.forces)
    if (forces == Acting::torques_of_known_hinges && force.name == "torsion")
      std::get<Rsda>(force.kind).law = f("k*sin(angle - rest) + mu*rate^3");
  const FormulationSettings settings = formulation_of_type(form);
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  INFO(d.not_planar);
  REQUIRE(d.planar);
  const VectorXd y = state(d, 3), angles = VectorXd::Constant(static_cast<Eigen::Index>(d.angles.size()), 0.2);
  Dynamics spatial(mechanism, settings), planar(mechanism, settings, Model::planar);
  VectorXd expected(y.size()), rate(y.size());
  REQUIRE(spatial.evaluate(kInstant, y, angles, expected));
  REQUIRE(planar.evaluate(kInstant, y, angles, rate));
  CHECK(apart(rate, expected) < 1e-11);

  const VectorXd a = expected.tail(7 * d.n), lambda = spatial.lambda();
  REQUIRE(spatial.linearise(kInstant, y, angles, a, lambda));
  REQUIRE(planar.linearise(kInstant, y, angles, a, lambda));
  const MatrixXd plane = plane_of(d);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows y_dir = directions(d, 4);
    CHECK(apart(tangent(planar, block, y_dir), tangent(spatial, block, y_dir)) < 1e-9);
  }
  // The transpose, on directions in the plane.
  std::srand(5);
  const VectorXd w = plane * VectorXd::Random(plane.cols());
  VectorXd y_bar = VectorXd::Zero(y.size()), theta_bar = VectorXd::Zero(d.slots()),
           rho_bar = VectorXd::Zero(d.rho.size());
  planar.add_adjoint(w, y_bar, theta_bar, rho_bar);
  VectorXd total = rho_bar;
  d.add_to_rho(theta_bar, total);
  const LaneRows y_dir = directions(d, 6);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows out = tangent(planar, block, y_dir);
    for (int k = 0; k < kLanes; ++k) {
      const double by_parameter = block.parameter[k] < 0 ? 0 : total(block.parameter[k]);
      const double forward = w.dot(out.col(k)), backward = y_bar.dot(y_dir.col(k)) + by_parameter;
      CHECK(std::abs(forward - backward) < 1e-10 * (std::abs(forward) + y_bar.norm() * y_dir.col(k).norm()));
    }
  }
}

TEST_CASE("the planar projection, its tangent and its adjoint are the spatial ones", "[planar]") {
  const Scene scene = planar_machine(GENERATE(2, 1));
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  REQUIRE(d.planar);
  const VectorXd angles = VectorXd::Constant(static_cast<Eigen::Index>(d.angles.size()), 0.2);
  const std::unique_ptr<Projector> spatial = make_projector(mechanism, Projection::position_velocity),
                                   planar = make_projector(mechanism, Projection::position_velocity, Model::planar);
  ProjectionSolution s = spatial->solution(), p = planar->solution();
  VectorXd start(14 * d.n), y_hat = state(d, 7), expected(14 * d.n), y(14 * d.n);
  REQUIRE(spatial->project(kInstant, angles, y_hat, start, s));  // onto the constraints, and off them by a step's error
  y_hat = start + 0.02 * (plane_of(d) * VectorXd::Random(8 * d.n));
  REQUIRE(spatial->project(kInstant, angles, y_hat, expected, s));
  REQUIRE(planar->project(kInstant, angles, y_hat, y, p));
  CHECK(apart(y, expected) < 1e-12);
  CHECK(planar->position_violation(kInstant, angles, y) < 1e-13);
  CHECK(planar->velocity_violation(kInstant, y) < 1e-13);
  CHECK(planar->velocity_violation(kInstant, y_hat) == Approx(spatial->velocity_violation(kInstant, y_hat)));

  REQUIRE(spatial->linearise(kInstant, angles, y_hat, expected, s));
  REQUIRE(planar->linearise(kInstant, angles, y_hat, expected, p));
  std::srand(8);
  const MatrixXd plane = plane_of(d);
  const VectorXd w = plane * VectorXd::Random(plane.cols());
  VectorXd y_bar = VectorXd::Zero(y.size()), theta_bar = VectorXd::Zero(d.slots()),
           total = VectorXd::Zero(d.rho.size());
  planar->add_adjoint(w, y_bar, theta_bar, total);
  d.add_to_rho(theta_bar, total);
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows dir = directions(d, 9);
    LaneRows out(y.size(), kLanes), reference(y.size(), kLanes);
    spatial->tangent(block, dir, reference);
    planar->tangent(block, dir, out);
    CHECK(apart(out, reference) < 1e-10);
    for (int k = 0; k < kLanes; ++k) {
      const double by_parameter = block.parameter[k] < 0 ? 0 : total(block.parameter[k]);
      const double forward = w.dot(out.col(k)), backward = y_bar.dot(dir.col(k)) + by_parameter;
      CHECK(std::abs(forward - backward) < 1e-11 * (std::abs(forward) + y_bar.norm() * dir.col(k).norm()));
    }
  }
}

TEST_CASE("a planar run takes the spatial run's steps to the same motion and gradient", "[planar]") {
  const std::string form = GENERATE(as<std::string>{}, "augmented_lagrangian", "penalty");
  Scene scene = planar_machine(GENERATE(2, 0), form != "penalty");
  scene.simulation.formulation = formulation_of_type(form);
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho);
  const auto run = [&](ModelChoice model, auto simulate_by) {
    SimulationSettings settings = scene.simulation;
    settings.model = model;
    std::vector<Cost> costs(1);
    costs[0].running = std::make_shared<StateNorm>();
    costs[0].terminal = std::make_shared<SensorProduct>(mechanism, 0, 1);
    SimulationResult result = simulate_by(settings, costs);
    INFO(result.message);
    REQUIRE(result.ok());
    return result;
  };
  const auto tlm = [&](const SimulationSettings& s, const std::vector<Cost>& c) {
    return simulate_tlm(mechanism, s, c);
  };
  const auto adjoint = [&](const SimulationSettings& s, const std::vector<Cost>& c) {
    return simulate_adjoint(mechanism, s, c);
  };
  const SimulationResult spatial = run(ModelChoice::spatial, adjoint), planar = run(ModelChoice::planar, adjoint),
                         planar_tlm = run(ModelChoice::planar, tlm);
  CHECK(planar.statistics.steps == spatial.statistics.steps);
  CHECK(apart(planar.y_end, spatial.y_end) < 1e-10);
  CHECK(apart(planar.psi, spatial.psi) < 1e-10);
  CHECK(apart(planar.psi_rho, spatial.psi_rho) < 1e-10);
  CHECK(apart(planar_tlm.psi_rho, planar.psi_rho) < 1e-10);
}

TEST_CASE("a spring feels a parameter that shifts its body along the normal", "[planar]") {
  Scene scene = pendulum();
  add_parameters(scene, {{"shift", 0.1}});
  scene.joints[0].point1 = PointField(vec("0", "0", "shift"));
  Tsda spring;
  spring.body1 = "ground", spring.point1 = PointField(vec("1", "0.5", "0.3")), spring.body2 = "bar";
  spring.point2 = PointField(vec("c", "0", "0")), spring.stiffness = 20.0, spring.free_length = 0.2;
  scene.forces.push_back({"spring", spring});
  scene.simulation.end_time = 0.5;
  scene.simulation.integrator.rtol = 1e-8, scene.simulation.integrator.atol = 1e-10;
  const Mechanism mechanism(scene, nominal(scene));
  REQUIRE(mechanism.data().planar);
  std::vector<Cost> costs(1);
  costs[0].running = std::make_shared<StateNorm>();
  SimulationSettings in_space = scene.simulation;
  in_space.model = ModelChoice::spatial;
  const SimulationResult tlm = simulate_tlm(mechanism, scene.simulation, costs),
                         adjoint = simulate_adjoint(mechanism, scene.simulation, costs),
                         spatial = simulate_adjoint(mechanism, in_space, costs);
  REQUIRE((tlm.ok() && adjoint.ok() && spatial.ok()));
  CHECK(std::abs(tlm.psi_rho(0, tlm.psi_rho.cols() - 1)) > 0.01);
  CHECK(apart(tlm.psi_rho, adjoint.psi_rho) < 1e-10);
  CHECK(apart(adjoint.psi_rho, spatial.psi_rho) < 1e-9);
}

TEST_CASE("the N-four-bar through its flat position: the planar model meets the spatial one", "[planar]") {
  Scene scene = n_four_bar(3);
  scene.simulation.end_time = 1;
  scene.simulation.integrator.rtol = 1e-9, scene.simulation.integrator.atol = 1e-11;
  const Mechanism mechanism(scene, nominal(scene));
  REQUIRE(mechanism.data().planar);
  SimulationSettings spatial = scene.simulation;
  spatial.model = ModelChoice::spatial;
  const SimulationResult a = simulate(mechanism, scene.simulation), b = simulate(mechanism, spatial);
  REQUIRE((a.ok() && b.ok()));
  CHECK(apart(a.y_end, b.y_end) < 1e-7);  // rounding, as the singular position magnifies it
  CHECK(a.statistics.max_position_violation < 1e-12);
}

TEST_CASE("only what joints hold in a plane, at every value of the parameters, is planar", "[planar]") {
  const auto reason = [](const Scene& s) { return Mechanism(s, nominal(s)).data().not_planar; };
  CHECK(reason(double_pendulum()).empty());
  CHECK(reason(four_bar()).empty());
  CHECK_THAT(reason(spatial_four_bar()), Catch::Contains("neither in the plane nor across it"));

  Scene free = double_pendulum();
  free.joints.pop_back();
  free.sensors.pop_back();
  CHECK_THAT(reason(free), Catch::Contains("no joint holds body 'lower'"));

  Scene tilting = double_pendulum();  // parallel now, but a parameter tilts it
  add_parameters(tilting, {{"tilt", 0.0}});
  tilting.joints[1].axis1 = vec("0", "sin(tilt)", "cos(tilt)");
  CHECK_THROWS_WITH(reason(tilting), Catch::Contains("joints[1]: its angle is used, and a parameter turns axis1 away"));
  tilting.joints[1].normal1 = tilting.joints[1].normal2 = vec("1", "0", "0");
  CHECK_FALSE(reason(tilting).empty());

  Scene hung = double_pendulum();  // by a ball
  hung.joints[1].type = "spherical", hung.joints[1].axis1.reset(), hung.joints[1].axis2.reset();
  hung.sensors.pop_back();
  CHECK_THAT(reason(hung), Catch::Contains("no joint holds body 'lower'"));

  // A rod from the ground to a puck on a higher plane, and to a slider on a higher rail.
  for (const std::string type : {"planar", "translational"}) {
    Scene raised;
    raised.bodies.push_back(body("puck", vec("0", "0", "0"), vec("0.4", "0.2", "0.3"), turned("0")));
    Joint table;
    table.name = "table", table.type = type, table.body2 = "puck", table.point1 = vec("0", "0.2", "0.3");
    table.axis1 = table.axis2 = type == "planar" ? vec("0", "0", "1") : vec("1", "0", "0");
    raised.joints.push_back(table);
    CHECK(reason(raised).empty());
    Joint rod;
    rod.name = "rod", rod.type = "distance", rod.body2 = "puck", rod.length = 0.5;
    raised.joints.push_back(rod);
    CHECK_FALSE(reason(raised).empty());
    if (type == "planar") CHECK_THAT(reason(raised), Catch::Contains("'rod'") && Catch::Contains("heights"));
  }

  Scene lifted = four_bar();
  Drive lift;
  lift.name = "lift", lift.type = "coordinate", lift.body = "crank", lift.coordinate = "x", lift.law = f("0.1*t");
  lifted.drives.push_back(lift);
  CHECK_THAT(reason(lifted), Catch::Contains("drive 'lift'"));
}

TEST_CASE("a planar model that is asked for and is none is refused with the reason", "[planar]") {
  Scene scene = spatial_four_bar();
  scene.simulation.model = ModelChoice::planar;
  const Mechanism mechanism(scene, nominal(scene));
  CHECK_THROWS_WITH(simulate(mechanism, scene.simulation),
                    Catch::Contains("simulation.model") && Catch::Contains("neither"));
  Scene implicit = four_bar();
  implicit.simulation.model = ModelChoice::planar, implicit.simulation.integrator.type = "radau5";
  CHECK_THROWS_WITH(simulate(Mechanism(implicit, nominal(implicit)), implicit.simulation), Catch::Contains("explicit"));
}

TEST_CASE("forces written in C++ keep the planar model, whose numbers are the spatial ones", "[planar]") {
  Scene scene = planar_machine(GENERATE(2, 0));
  add_parameters(scene, {{"drag", 0.4}});
  scene.simulation.end_time = 0.3;
  scene.simulation.integrator.type = "dopri5";
  scene.simulation.integrator.step = 0.005;
  const Eigen::Index drag = static_cast<Eigen::Index>(scene.parameters.size()) - 1;
  const Mechanism m(scene, nominal(scene), {}, {std::make_shared<CubicDrag>(scene.bodies[1].name, drag)});
  INFO(m.data().not_planar);
  REQUIRE(m.data().planar);
  std::vector<Cost> costs(1);
  costs[0].terminal = costs[0].running = std::make_shared<StateNorm>();
  SimulationSettings in_plane = scene.simulation, in_space = scene.simulation;
  in_plane.model = ModelChoice::planar, in_space.model = ModelChoice::spatial;
  const SimulationResult expected = simulate_adjoint(m, in_space, costs),
                         adjoint = simulate_adjoint(m, in_plane, costs), tlm = simulate_tlm(m, in_plane, costs);
  INFO(expected.message << adjoint.message << tlm.message);
  REQUIRE((expected.ok() && adjoint.ok() && tlm.ok()));
  CHECK(apart(adjoint.y_end, expected.y_end) < 1e-10);
  CHECK(std::abs(expected.psi_rho(0, drag)) > 1e-6 * size_of(expected.psi_rho));
  CHECK(apart(adjoint.psi_rho, expected.psi_rho) < 1e-9);
  CHECK(apart(tlm.psi_rho, expected.psi_rho) < 1e-9);
}
