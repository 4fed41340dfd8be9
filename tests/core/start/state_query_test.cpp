// Each matrix of the equations of motion is compared with differences, or with the equation that it stands in.
#include "core/start/state_query.hpp"

#include <catch2/catch.hpp>
#include <functional>

#include "core/force/user_force.hpp"
#include "core/simulate/simulation.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/small_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// k (x - 0.3)^2 along x on the link's centre of mass, and a damper.
struct Cushion final : UserForce {
  std::vector<std::string> bodies() const override { return {"link"}; }
  void Q(double, VecIn q, VecIn v, VecIn rho, VecOut Q) const override {
    Q(0) = -rho(0) * (q(0) - 0.3) * (q(0) - 0.3) - 0.7 * v(0);
  }
  void K(double, VecIn q, VecIn, VecIn rho, MatOut K) const override { K(0, 0) = 2 * rho(0) * (q(0) - 0.3); }
  void C(double, VecIn, VecIn, VecIn, MatOut C) const override { C(0, 0) = 0.7; }
  void Q_rho(double, VecIn q, VecIn, VecIn, MatOut Q_rho) const override { Q_rho(0, 0) = -(q(0) - 0.3) * (q(0) - 0.3); }
};

// An arm on a ball, a link hinged to it, a rod of constant distance from the link to the ground, and a spring.
Scene queried_linkage() {
  Scene s;
  add_parameters(s, {{"k", 30}, {"L", 0.5}, {"m", 1.4}});
  s.bodies = {body("arm", vec("L/2", "0.01", "0"), vec("0", "0", "0"), turned("0.3")),
              body("link", vec("0.1", "0", "0.02"), vec("L*cos(0.3)", "L*sin(0.3)", "0"), turned("-0.5"))};
  s.bodies[1].mass = f("m");
  s.bodies[0].angular_velocity = vec("0.4", "-0.3", "1.1");
  s.bodies[1].angular_velocity = vec("0.4", "-0.3", "-0.6");
  s.joints = {ball("foot", "ground", vec("0", "0", "0"), "arm", vec("0", "0", "0")),
              hinge("knee", "arm", vec("L", "0", "0"), "link", vec("0", "0", "0"))};
  Joint rod;
  rod.name = "rod", rod.type = "distance", rod.body2 = "link";
  rod.point1 = vec("0.9", "0.2", "0.4"), rod.point2 = vec("0.3", "0", "0"), rod.length = 0.45;
  s.joints.push_back(rod);
  Tsda spring;
  spring.body1 = "ground", spring.body2 = "arm", spring.point2 = vec("0.2", "0.1", "0");
  spring.point1 = vec("0", "0.5", "0.3"), spring.stiffness = f("k"), spring.damping = 2.0, spring.free_length = 0.3;
  s.forces.push_back({"spring", spring});
  s.sensors = {point_sensor("a", "acceleration", "link", vec("0.2", "0.1", "-0.3"), "y")};
  return s;
}

struct Fixture {
  Scene scene = queried_linkage();
  VectorXd rho = nominal(scene);
  Mechanism mechanism = at(rho);
  Assembly assembly{mechanism, 0};
  VectorXd y = assembly.result().y, angles = assembly.result().angles;

  Mechanism at(const VectorXd& values) const { return Mechanism(scene, values, {}, {std::make_shared<Cushion>()}); }
  StateQuery query(const VectorXd& state) const {
    return StateQuery(mechanism, scene.simulation.formulation, {0, state, angles});
  }
};

// Columns of central differences of second order; their error is of the order of 1e-10 here.
MatrixXd differences(const VectorXd& x, const std::function<VectorXd(const VectorXd&)>& f, Eigen::Index first,
                     Eigen::Index count) {
  constexpr double h = 1e-5;
  MatrixXd out(f(x).size(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    VectorXd above = x, below = x;
    above(first + k) += h, below(first + k) -= h;
    out.col(k) = (f(above) - f(below)) / (2 * h);
  }
  return out;
}
constexpr double kDifferences = 1e-7;

double largest(const MatrixXd& x) { return x.cwiseAbs().maxCoeff<Eigen::PropagateNaN>(); }

}  // namespace

TEST_CASE("a query of a state satisfies the equations of motion in coordinates", "[state_query]") {
  Fixture x;
  REQUIRE(x.assembly.result().ok);
  StateQuery at = x.query(x.y);
  const VectorXd v = x.y.tail(14);
  CHECK(v.norm() > 0.5);
  CHECK(largest(at.M() * at.qddot() + at.Phi_q().transpose() * at.lambda() - at.Q()) < 1e-10);
  CHECK(largest(at.Phi_q() * at.qddot() + at.Phiddot_v()) < 1e-10);
  CHECK(largest(at.Phi()) < 1e-12);
  CHECK(largest(at.Phidot()) < 1e-12);
  CHECK(largest(at.Phi_q() * v - at.Phidot()) < 1e-13);  // no law of time
  CHECK((at.rows("knee").first == 3 && at.rows("knee").count == 5 && at.rows("rod").count == 1));
  CHECK(at.index("link") == 7);
  CHECK_THROWS_AS(at.rows("elbow"), std::invalid_argument);
  CHECK_THROWS_AS(at.body("elbow"), std::invalid_argument);
  CHECK_THROWS_AS(at.body("ground"), std::invalid_argument);
}

TEST_CASE("matrices of a query are differences of their functions", "[state_query]") {
  Fixture x;
  StateQuery at = x.query(x.y);
  const auto of_state = [&](const auto& value) {
    return [&, value](const VectorXd& y) -> VectorXd { return value(x.query(y)); };
  };
  const auto phi = of_state([](const StateQuery& q) { return q.Phi(); });
  const auto phidot = of_state([](const StateQuery& q) { return q.Phidot(); });
  const auto load = of_state([](const StateQuery& q) { return q.Q(); });
  const auto acceleration = of_state([](const StateQuery& q) { return q.qddot(); });
  CHECK(largest(at.Phi_q() - differences(x.y, phi, 0, 14)) < kDifferences);
  CHECK(largest(at.Phiddot_v() - differences(x.y, phidot, 0, 14) * x.y.tail(14)) < kDifferences);
  CHECK(largest(at.K()) > 1);
  CHECK(largest(at.C()) > 0.5);
  CHECK(largest(at.K() + differences(x.y, load, 0, 14)) < kDifferences * largest(at.K()));
  CHECK(largest(at.C() + differences(x.y, load, 14, 14)) < kDifferences * largest(at.C()));
  CHECK(largest(at.F_y().bottomRows(14) - differences(x.y, acceleration, 0, 28)) < kDifferences * largest(at.F_y()));
  CHECK(at.F_y().topRightCorner(14, 14) == MatrixXd::Identity(14, 14));
  const auto of_rho = [&](const VectorXd& rho) -> VectorXd {
    return StateQuery(x.at(rho), x.scene.simulation.formulation, {0, x.y, x.angles}).qddot();
  };
  CHECK(largest(at.F_rho().bottomRows(14) - differences(x.rho, of_rho, 0, 3)) < kDifferences * largest(at.F_rho()));
}

TEST_CASE("points and bodies of a query move as a run moves them", "[state_query]") {
  Fixture x;
  x.scene.simulation.integrator.type = "dopri853";
  x.scene.simulation.integrator.rtol = 1e-12, x.scene.simulation.integrator.atol = 1e-13;
  x.scene.simulation.end_time = 0.2;
  const double h = 1e-3;
  std::vector<PointMotion> point;
  std::vector<BodyMotion> link;
  const Sampling sampling{{0.1 - h, 0.1, 0.1 + h}, [&](std::size_t, const StatePoint& at) {
                            const StateQuery query(x.mechanism, x.scene.simulation.formulation, at);
                            point.push_back(query.point("link", {0.2, 0.1, -0.3})), link.push_back(query.body("link"));
                            StatePoint with_motion = at;
                            CHECK(query.point("link", {0.2, 0.1, -0.3}).acceleration(1) ==
                                  Approx(x.mechanism.sensor_value(0, with_motion)).epsilon(1e-10));
                          }};
  const SimulationResult run = simulate(x.mechanism, x.scene.simulation, {}, sampling);
  INFO(run.message);
  REQUIRE(run.ok());
  REQUIRE(point.size() == 3);
  const auto slope = [&](const auto& of) { return Eigen::VectorXd((of(2) - of(0)) / (2 * h)); };
  using Eigen::Vector3d;
  // Central differences of a motion whose third derivatives are of the order of 100.
  CHECK(largest(slope([&](int k) { return Vector3d(point[k].position); }) - point[1].velocity) < 1e-4);
  CHECK(largest(slope([&](int k) { return Vector3d(point[k].velocity); }) - point[1].acceleration) < 1e-3);
  CHECK(largest(slope([&](int k) { return Vector3d(link[k].omega); }) - link[1].omegadot) < 1e-3);
  CHECK(largest(slope([&](int k) { return Eigen::Vector4d(link[k].pdot); }) - link[1].pddot) < 1e-3);
}

namespace {
struct EndHeight final : TerminalCost {
  double value(VecIn y, VecIn) const override { return y(9) * y(9) + y(0); }
  void adjoint_init(VecIn y, VecIn, VecOut lambda, VecOut) const override { lambda(9) = 2 * y(9), lambda(0) = 1; }
};
}  // namespace

TEST_CASE("a run starts at a given state, and goes on as the run that reached it", "[state_query]") {
  Fixture x;
  x.scene.simulation.integrator.type = "dopri853";
  x.scene.simulation.integrator.rtol = 1e-11, x.scene.simulation.integrator.atol = 1e-12;
  x.scene.simulation.end_time = 0.3;
  SimulationSettings half = x.scene.simulation, rest = half;
  half.end_time = rest.start_time = 0.12;
  const SimulationResult whole = simulate(x.mechanism, x.scene.simulation);
  const SimulationResult first = simulate(x.mechanism, half);
  REQUIRE((whole.ok() && first.ok()));
  const Scene later = starting_at(x.scene, x.mechanism, first.y_end);
  const Mechanism mechanism(later, x.rho, {}, {std::make_shared<Cushion>()});
  const SimulationResult second = simulate(mechanism, rest);
  REQUIRE(second.ok());
  CHECK(largest(second.y_initial - first.y_end) < 1e-13);
  CHECK(largest(second.y_end - whole.y_end) < 1e-8);
  CHECK_THROWS_AS(starting_at(x.scene, x.mechanism, VectorXd::Zero(3)), std::invalid_argument);
}

TEST_CASE("d psi/dy at the start is what differences of runs from given states say", "[state_query]") {
  Fixture x;  // a free body: every change of r, v is a state, too
  x.scene.joints.clear();
  x.scene.simulation.integrator.type = "dopri853";
  x.scene.simulation.integrator.rtol = 1e-12, x.scene.simulation.integrator.atol = 1e-13;
  x.scene.simulation.end_time = 0.3;
  const Mechanism free = x.at(x.rho);
  std::vector<Cost> costs(1);
  costs[0].terminal = point_cost(std::make_shared<EndHeight>(), free);
  const SimulationResult run = simulate_adjoint(free, x.scene.simulation, costs);
  REQUIRE(run.ok());
  REQUIRE((run.psi_y_initial.rows() == 1 && run.psi_y_initial.cols() == 28));
  const auto psi = [&](const VectorXd& y) -> VectorXd {
    const Scene there = starting_at(x.scene, free, y);
    return simulate(Mechanism(there, x.rho, {}, {std::make_shared<Cushion>()}), there.simulation, costs).psi;
  };
  for (const Eigen::Index k : {0, 1, 7, 9, 14, 21, 23}) {
    INFO("component " << k);
    CHECK(differences(run.y_initial, psi, k, 1)(0, 0) == Approx(run.psi_y_initial(0, k)).epsilon(1e-7).margin(1e-8));
  }
}
