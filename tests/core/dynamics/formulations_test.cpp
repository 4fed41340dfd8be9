// What the formulations and their linear solvers cost in accuracy: accelerations against the same equations, from the
// same M, J, f and gamma, solved in 113 bits. docs/formulations.md has the table.
#include <Eigen/LU>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/eigen.hpp>
#include <catch2/catch.hpp>

#include "core/dynamics/spatial_dynamics.hpp"
#include "core/simulate/simulation.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::VectorXd;

namespace {

using Quad = boost::multiprecision::cpp_bin_float_quad;
using MatrixXq = Eigen::Matrix<Quad, Eigen::Dynamic, Eigen::Dynamic>;
using VectorXq = Eigen::Matrix<Quad, Eigen::Dynamic, 1>;

// Rods of 1 kg and 1 m, turning and falling, on hinges about y and z in turn.
Scene chain(int links) {
  Scene s;
  for (int i = 0; i < links; ++i) {
    Body rod = plain_body(fmt::format("rod{}", i), 1, {0.02, 0.08, 0.09, 0.001, 0.002, 0.003},
                          {static_cast<double>(i), 0.0, 0.0});
    rod.com = {0.5, 0.01, 0.02};
    rod.angular_velocity = {0.0, i % 2 == 0 ? 1.0 : 0.3, i % 2 == 0 ? 0.2 : -0.7};
    s.bodies.push_back(rod);
    Joint joint = hinge(fmt::format("hinge{}", i), i == 0 ? "ground" : s.bodies[s.bodies.size() - 2].name,
                        vec(i == 0 ? "0" : "1", "0", "0"), rod.name, vec("0", "0", "0"));
    if (i % 2 == 0) joint.axis1 = joint.axis2 = vec("0", "1", "0");
    s.joints.push_back(joint);
  }
  return s;
}

FormulationSettings penalty(double alpha, LinearSolver solver) {
  FormulationSettings s = FormulationSettings::penalty();
  s.alpha = alpha, s.linear_solver = solver, s.omega = 0;
  return s;
}

VectorXd accelerations(const std::vector<Vec<6>>& z) {
  VectorXd x(6 * static_cast<Eigen::Index>(z.size()));
  for (std::size_t i = 0; i < z.size(); ++i) x.segment<6>(6 * static_cast<Eigen::Index>(i)) = z[i];
  return x;
}

// (z, lambda) of [M J'; J -c] (z, lambda) = (f, -gamma), from what SpatialDynamics has evaluated.
VectorXq exact(SpatialDynamics& at, const Quad& c) {
  const MechanismData& d = at.data();
  const Eigen::Index n = 6 * d.n;
  MatrixXq K = MatrixXq::Zero(n + d.m, n + d.m);
  VectorXq rhs(n + d.m);
  for (int i = 0; i < d.n; ++i) {
    const BodyData& b = d.bodies[static_cast<std::size_t>(i) + 1];
    K.block<3, 3>(6 * i, 6 * i).diagonal().setConstant(b.mass);
    K.block<3, 3>(6 * i + 3, 6 * i + 3) = b.J.cast<Quad>();
  }
  Eigen::MatrixXd rows;
  at.solver().rows().write_dense(rows);
  const MatrixXq J = rows.cast<Quad>();
  K.bottomLeftCorner(d.m, n) = J;
  K.topRightCorner(n, d.m) = J.transpose();
  K.bottomRightCorner(d.m, d.m).diagonal().setConstant(-c);
  rhs << accelerations(at.loads()).cast<Quad>(), -at.gamma().cast<Quad>();
  return K.partialPivLu().solve(rhs);
}

double relative_error(const VectorXq& z, const VectorXq& expected) {
  return static_cast<double>((z - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff());
}

struct Errors {
  double model, cholesky, quasidefinite, augmented_lagrangian;
};

Errors errors(const Scene& scene, double alpha) {
  const Mechanism mechanism(scene, VectorXd());
  std::srand(3);
  const MechanismData& d = mechanism.data();
  VectorXd y = 0.3 * VectorXd::Random(14 * d.n), ydot(y.size());
  for (int i = 1; i <= d.n; ++i) {
    y.segment<7>(7 * (i - 1)) += d.bodies[static_cast<std::size_t>(i)].q;
    y.segment<4>(7 * (i - 1) + 3).normalize();
  }
  SpatialDynamics cholesky(mechanism, penalty(alpha, LinearSolver::cholesky));
  SpatialDynamics quasidefinite(mechanism, penalty(alpha, LinearSolver::quasidefinite));
  FormulationSettings iterated;
  iterated.alpha = alpha, iterated.iterations = 3, iterated.tolerance = 0;
  SpatialDynamics augmented(mechanism, iterated);
  for (SpatialDynamics* x : {&cholesky, &quasidefinite, &augmented}) x->evaluate(0, y, VectorXd(), ydot);
  const VectorXq with_penalty = exact(quasidefinite, Quad(1) / Quad(alpha)).head(6 * d.n);
  const VectorXq constrained = exact(augmented, 0).head(6 * d.n);
  auto of = [](const SpatialDynamics& x) { return VectorXq(accelerations(x.z()).cast<Quad>()); };
  return {relative_error(with_penalty, constrained), relative_error(of(cholesky), with_penalty),
          relative_error(of(quasidefinite), with_penalty), relative_error(of(augmented), constrained)};
}

Errors errors(int links, double alpha) { return errors(chain(links), alpha); }

}  // namespace

TEST_CASE("penalty is off the constrained equations by about 1/alpha", "[formulation]") {
  const double alpha = GENERATE(1e3, 1e5, 1e7, 1e9, 1e11, 1e13, 1e15);
  const Errors e = errors(GENERATE(2, 5), alpha);
  CHECK(e.model * alpha > 0.3);
  CHECK(e.model * alpha < 10);
}

TEST_CASE("by Cholesky the digits that penalty loses grow with alpha", "[formulation]") {
  const auto [alpha, order] = GENERATE(table<double, double>(
      {{1e3, 1e-13}, {1e5, 2e-11}, {1e7, 2e-9}, {1e9, 2e-7}, {1e11, 2e-5}, {1e13, 1e-3}, {1e15, 0.4}}));
  const double error = errors(GENERATE(2, 5), alpha).cholesky;
  CHECK(error > order / 30);  // of rounding errors only the order of magnitude is the same everywhere
  CHECK(error < order * 30);
}

TEST_CASE("the quasi-definite solution keeps all digits at any alpha", "[formulation]") {
  const double alpha = GENERATE(1.0, 1e3, 1e5, 1e6, 1e7, 1e8, 1e9, 1e11, 1e13, 1e15);
  CHECK(errors(GENERATE(2, 5), alpha).quasidefinite < 2e-15);
}

TEST_CASE("mass ratios up to 1e8 cost the quasi-definite solution no digits", "[formulation]") {
  const double ratio = GENERATE(1e2, 1e4, 1e6, 1e8), alpha = GENERATE(1e3, 1e6, 1e9, 1e12);
  const int order = GENERATE(0, 1, 2);  // heavy between light, growing outwards, growing inwards
  Scene scene = chain(5);
  for (std::size_t i = 0; i < 5; ++i) {
    const double grown = static_cast<double>(order == 1 ? i : 4 - i) / 4;
    const double factor = order == 0 ? (i % 2 == 1 ? ratio : 1) : std::pow(ratio, grown);
    Body& b = scene.bodies[i];
    for (Field* x : {&b.mass, &b.inertia.xx, &b.inertia.yy, &b.inertia.zz, &b.inertia.xy, &b.inertia.xz, &b.inertia.yz})
      *x = factor * x->number();
  }
  INFO("ratio " << ratio << ", order " << order << ", alpha " << alpha);
  CHECK(errors(scene, alpha).quasidefinite < 2e-14);
}

// alpha is relative here: 0.17 to 1 of it is its absolute value in the rows of these chains.
TEST_CASE("three iterations of the augmented Lagrangian reach rounding at moderate alpha, and lose it beyond",
          "[formulation]") {
  const auto [alpha, bound] = GENERATE(table<double, double>(
      {{1e3, 1e-6}, {1e5, 2e-15}, {1e7, 2e-15}, {1e9, 2e-15}, {1e11, 2e-15}, {1e13, 1e-9}, {1e15, 2e-2}}));
  CHECK(errors(GENERATE(2, 5), alpha).augmented_lagrangian < bound);
}

TEST_CASE("by Cholesky penalty starves the step-size control, which quasi-definite does not", "[formulation]") {
  Scene scene = chain(2);
  scene.simulation.end_time = 2;
  scene.simulation.integrator.type = "dopri853";
  scene.simulation.integrator.rtol = 1e-9, scene.simulation.integrator.atol = 1e-11;
  scene.simulation.formulation.projection = Projection::none;
  auto right_hand_sides = [&](const FormulationSettings& formulation) {
    SimulationSettings settings = scene.simulation;
    settings.formulation = formulation;
    const SimulationResult run = simulate(Mechanism(scene, VectorXd()), settings);
    INFO(run.message);
    REQUIRE(run.ok());
    return run.statistics.rhs_evaluations;
  };
  const long quasidefinite = right_hand_sides(penalty(1e9, LinearSolver::quasidefinite));
  CHECK(10 * quasidefinite < right_hand_sides(penalty(1e9, LinearSolver::cholesky)));
  CHECK(10 * quasidefinite <= 11 * right_hand_sides(scene.simulation.formulation));
  scene.simulation.integrator.rtol = 1e-12, scene.simulation.integrator.atol = 1e-12;
  CHECK(right_hand_sides(penalty(1e9, LinearSolver::quasidefinite)) < 5 * quasidefinite);
}

// A four-bar of spatial hinges in its plane: three rows too many, and velocities out of the plane make them disagree.
struct RedundantRows {
  Scene scene = four_bar();
  VectorXd rho = nominal(scene);
  VectorXd y, angles = VectorXd::Zero(1);

  RedundantRows() {
    const Mechanism mechanism(scene, rho);
    const MechanismData& d = mechanism.data();
    std::srand(9);
    y = 0.4 * VectorXd::Random(14 * d.n);
    for (int i = 1; i <= d.n; ++i) y.segment<7>(7 * (i - 1)) = d.bodies[static_cast<std::size_t>(i)].q;
  }
};

TEST_CASE("redundant rows that disagree leave quasi-definite accelerations and multipliers right", "[formulation]") {
  const RedundantRows c;
  const double alpha = GENERATE(1e4, 1e6, 1e8, 1e9, 1e11);
  SpatialDynamics dynamics(Mechanism(c.scene, c.rho), penalty(alpha, LinearSolver::quasidefinite));
  VectorXd ydot(c.y.size());
  REQUIRE(dynamics.evaluate(0, c.y, c.angles, ydot));
  const VectorXq expected = exact(dynamics, Quad(1) / Quad(alpha));
  const Eigen::Index n = 6 * dynamics.data().n;
  // J is redundant to rounding only, which alpha enlarges.
  INFO("alpha " << alpha);
  CHECK(relative_error(accelerations(dynamics.z()).cast<Quad>(), expected.head(n)) < 1e-15 * std::max(1e2, alpha));
  CHECK(relative_error(dynamics.lambda().cast<Quad>(), expected.tail(dynamics.data().m)) < 1e-10);
}

TEST_CASE("where redundant rows disagree, the quasi-definite tangent equals differences", "[formulation]") {
  const RedundantRows c;
  const FormulationSettings settings = penalty(GENERATE(1e4, 1e6), LinearSolver::quasidefinite);
  const Mechanism mechanism(c.scene, c.rho);
  SpatialDynamics dynamics(mechanism, settings);
  auto ydot = [&](const Mechanism& at) {
    VectorXd out(c.y.size());
    REQUIRE(SpatialDynamics(at, settings).evaluate(0, c.y, c.angles, out));
    return out;
  };
  VectorXd rate(c.y.size());
  REQUIRE(dynamics.evaluate(0, c.y, c.angles, rate));
  dynamics.linearise_here();
  const LaneRows still = LaneRows::Zero(c.y.size(), kLanes);
  LaneRows out(c.y.size(), kLanes);
  const double h = 1e-5;
  for (const ParameterBlock& block : parameter_blocks(mechanism.data())) {
    dynamics.tangent(block, still, out);
    for (int k = 0; k < kLanes; ++k) {
      if (block.parameter[k] < 0) continue;
      VectorXd up = c.rho, down = c.rho;
      up(block.parameter[k]) += h, down(block.parameter[k]) -= h;
      const VectorXd difference = (ydot(Mechanism(c.scene, up)) - ydot(Mechanism(c.scene, down))) / (2 * h);
      INFO(c.scene.parameters[static_cast<std::size_t>(block.parameter[k])].name);
      CHECK((difference - out.col(k)).cwiseAbs().maxCoeff() < 1e-7 * std::max(1.0, rate.cwiseAbs().maxCoeff()));
    }
  }
}
