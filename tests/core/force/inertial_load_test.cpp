// Mass terms of users: against bodies that have the same mass themselves, and against laws of conservation.
#include <catch2/catch.hpp>

#include "core/force/differentiated_force.hpp"
#include "core/mechanism/mechanism.hpp"
#include "core/simulate/simulation.hpp"
#include "core/start/state_query.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

template <class T>
using Vector3 = Eigen::Vector3<T>;

// Angular velocity in body axes, of q = (r, p) and v.
template <class T>
Vector3<T> omega_of(const Eigen::VectorX<T>& q, const Eigen::VectorX<T>& v) {
  const Vector3<T> e = q.template tail<3>(), edot = v.template tail<3>();
  return 2.0 * (q(3) * edot - v(3) * e - e.cross(edot));
}
template <class T>
Vector3<T> turned_by(const Eigen::VectorX<T>& q, const Vector3<T>& x, double sign) {  // A x, or A'x with sign -1
  const Vector3<T> e = sign * q.template tail<3>();
  const Vector3<T> c = e.cross(x);
  return x + 2.0 * (q(3) * c + e.cross(c));
}

// Mass m and inertia j (1, 2, 0; xy 0.3) load the coupler by rho(m) (g - rddot), -(J omegadot + omega x J omega).
struct Ballast final : DifferentiatedInertia<Ballast> {
  Eigen::Index m, j, g;
  Ballast(Eigen::Index mass, Eigen::Index inertia, Eigen::Index gravity) : m(mass), j(inertia), g(gravity) {}
  std::vector<std::string> bodies() const override { return {"coupler"}; }
  template <class T>
  void load(const VectorX<T>& q, const VectorX<T>& v, const VectorX<T>& z, const VectorX<T>& rho, VectorX<T>& L) const {
    Eigen::Matrix3<T> J = Eigen::Matrix3<T>::Constant(T(0));
    J(0, 0) = rho(j), J(1, 1) = 2.0 * rho(j), J(0, 1) = J(1, 0) = 0.3 * rho(j);
    const Vector3<T> omega = omega_of<T>(q, v), Jw = J * omega;
    Vector3<T> gravity = Vector3<T>::Constant(T(0));
    gravity(0) = 0.2 * rho(g), gravity(2) = -rho(g);
    L.template head<3>() = rho(m) * (gravity - z.template head<3>());
    L.template tail<3>() = -(J * z.template tail<3>() + omega.cross(Jw));
  }
};

// Fluid that a body without symmetry carries along, by Kirchhoff: kinetic energy v'M v/2 in body axes.
struct Fluid final : DifferentiatedInertia<Fluid> {
  std::vector<std::string> bodies() const override { return {"hull"}; }
  template <class T>
  void load(const VectorX<T>& q, const VectorX<T>& v, const VectorX<T>& z, const VectorX<T>& rho, VectorX<T>& L) const {
    const Vector3<T> omega = omega_of<T>(q, v), v_B = turned_by<T>(q, v.template head<3>(), -1);
    const Vector3<T> vdot_B = turned_by<T>(q, z.template head<3>(), -1) - omega.cross(v_B);
    const Vector3<T> M(rho(0), rho(1), rho(2));
    const Vector3<T> P = M.cwiseProduct(v_B), force_B = -(M.cwiseProduct(vdot_B) + omega.cross(P));
    L.template head<3>() = turned_by<T>(q, force_B, 1);
    L.template tail<3>() = -v_B.cross(P);
  }
};

struct Two final : DifferentiatedInertia<Two> {
  std::vector<std::string> bodies() const override { return {"upper", "lower"}; }
  template <class T>
  void load(const VectorX<T>&, const VectorX<T>&, const VectorX<T>&, const VectorX<T>&, VectorX<T>&) const {}
};

struct EndNorm final : TerminalCost {
  double value(VecIn y, VecIn) const override { return y.squaredNorm(); }
  void adjoint_init(VecIn y, VecIn, VecOut lambda, VecOut mu) const override {
    lambda = 2 * y;
    mu.setZero();
  }
};

}  // namespace

TEST_CASE("mass that a user adds to a body moves as the body's own, with all derivatives", "[inertia]") {
  Scene scene = loaded_four_bar();
  add_parameters(scene, {{"ma", 0.6}, {"ja", 0.05}});
  const Eigen::Index parameters = static_cast<Eigen::Index>(scene.parameters.size());
  scene.simulation.end_time = 0.4;
  scene.simulation.integrator.type = GENERATE("dopri5", "radau5", "sdirk4", "rodas4");
  scene.simulation.integrator.step = 0.005;
  scene.simulation.formulation = GENERATE(FormulationSettings(), FormulationSettings::penalty());
  scene.simulation.model = ModelChoice::spatial;
  Scene own = scene;
  Body& coupler = own.bodies[1];
  REQUIRE(coupler.name == "coupler");
  coupler.mass = coupler.mass + f("ma");
  coupler.inertia.xx = coupler.inertia.xx + f("ja"), coupler.inertia.yy = coupler.inertia.yy + f("2*ja");
  coupler.inertia.xy = coupler.inertia.xy + f("0.3*ja");
  Eigen::Index g = 0;
  while (scene.parameters[static_cast<std::size_t>(g)].name != "g") ++g;
  const Mechanism with(scene, nominal(scene), {}, {std::make_shared<Ballast>(parameters - 2, parameters - 1, g)}),
      alone(own, nominal(own));
  std::vector<Cost> costs(1), costs_alone(1);
  costs[0].terminal = point_cost(std::make_shared<EndNorm>(), with);
  costs_alone[0].terminal = point_cost(std::make_shared<EndNorm>(), alone);
  const SimulationResult expected = simulate_adjoint(alone, own.simulation, costs_alone),
                         adjoint = simulate_adjoint(with, scene.simulation, costs),
                         tlm = simulate_tlm(with, scene.simulation, costs);
  INFO(scene.simulation.integrator.type << ": " << expected.message << adjoint.message << tlm.message);
  REQUIRE((expected.ok() && adjoint.ok() && tlm.ok()));
  const bool penalty = scene.simulation.formulation.type == FormulationType::penalty;
  const double same = penalty ? 1e-6 : 1e-10;  // the penalty form is solved to its rounding, alpha times larger
  CHECK((adjoint.y_end - expected.y_end).cwiseAbs().maxCoeff() < same);
  const double size = expected.psi_rho.cwiseAbs().maxCoeff();
  CHECK(std::abs(expected.psi_rho(0, parameters - 2)) > 1e-4 * size);
  CHECK(std::abs(expected.psi_rho(0, parameters - 1)) > 1e-4 * size);
  CHECK((adjoint.psi_rho - expected.psi_rho).cwiseAbs().maxCoeff() < 10 * same * size);
  CHECK((adjoint.psi_rho - tlm.psi_rho).cwiseAbs().maxCoeff() < (penalty ? 1e-6 : 1e-10) * size);
}

TEST_CASE("a body in a fluid keeps its energy and momentum, and its M is a state query", "[inertia]") {
  Scene scene;
  add_parameters(scene, {{"mx", 0.3}, {"my", 1.2}, {"mz", 2.0}});
  Body hull = plain_body("hull", 1.5, {0.2, 0.3, 0.4, 0.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
  hull.velocity = {0.8, -0.3, 0.5}, hull.angular_velocity = {0.4, 1.1, -0.7};
  scene.bodies.push_back(hull);
  scene.gravity = {0.0, 0.0, 0.0};
  scene.simulation.end_time = 3;
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-12, scene.simulation.integrator.atol = 1e-14;
  const Mechanism m(scene, nominal(scene), {}, {std::make_shared<Fluid>()});
  const Vector3d added(0.3, 1.2, 2.0), J(0.2, 0.3, 0.4);
  const auto energy_and_momentum = [&](const VectorXd& y) {
    const VectorXd q = y.head(7), v = y.tail(7);
    const Vector3d omega = omega_of<double>(q, v), v_B = turned_by<double>(q, v.head<3>(), -1);
    const Vector3d P = added.cwiseProduct(v_B);
    Eigen::Vector4d out;
    out << 1.5 * v.head<3>() + turned_by<double>(q, P, 1),
        0.5 * (1.5 * v_B.squaredNorm() + v_B.dot(P) + omega.dot(J.cwiseProduct(omega)));
    return out;
  };
  const SimulationResult run = simulate(m, scene.simulation);
  INFO(run.message);
  REQUIRE(run.ok());
  CHECK((run.y_end - run.y_initial).norm() > 1);
  CHECK((energy_and_momentum(run.y_end) - energy_and_momentum(run.y_initial)).norm() < 1e-10);
  // Kinetic energy of v = qdot with the matrix of the query.
  const StatePoint at{3, run.y_end, VectorXd(), nullptr};
  const StateQuery query(m, scene.simulation.formulation, at);
  const VectorXd v = run.y_end.tail(7);
  CHECK(0.5 * v.dot(query.M() * v) == Approx(energy_and_momentum(run.y_end)(3)).epsilon(1e-12));
}

TEST_CASE("mass terms act on one body", "[inertia]") {
  const Scene scene = double_pendulum();
  CHECK_THROWS_WITH(Mechanism(scene, nominal(scene), {}, {std::make_shared<Two>()}),
                    Catch::Contains("mass terms act on one body"));
}
