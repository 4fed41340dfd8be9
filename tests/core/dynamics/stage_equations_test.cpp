// The equations of motion as residuals in (a, lambda): zero at the solution; tangent, adjoint and Jacobian against
// differences and against each other.
#include <catch2/catch.hpp>

#include "core/dynamics/motion_jacobian.hpp"
#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

FormulationSettings stabilised_penalty() {
  FormulationSettings s = FormulationSettings::penalty();
  s.alpha = 1e4;
  return s;
}

// A scene at its start, moved off the solution: nothing below may rely on r = 0.
struct Place {
  Scene scene;
  std::vector<std::shared_ptr<const UserForce>> forces;
  Mechanism mechanism;
  SpatialDynamics dynamics;
  StageEquations equations;
  double t = 0.1;
  VectorXd y, angles, a, lambda;

  explicit Place(Scene s, std::vector<std::shared_ptr<const UserForce>> user = {},
                 const FormulationSettings& formulation = {})
      : scene(std::move(s)),
        forces(std::move(user)),
        mechanism(scene, nominal(scene), {}, forces),
        dynamics(mechanism, formulation),
        equations(dynamics) {
    const Assembly assembly(mechanism, t);
    REQUIRE(assembly.result().ok);
    y = assembly.result().y, angles = assembly.result().angles;
    VectorXd ydot(y.size());
    REQUIRE(dynamics.evaluate(t, y, angles, ydot));
    a = ydot.tail(y.size() / 2), lambda = dynamics.lambda();
  }
  void move() {
    std::srand(7);
    y += 0.02 * VectorXd::Random(y.size());
    a += 0.3 * VectorXd::Random(a.size());
    lambda += 0.3 * VectorXd::Random(lambda.size());
  }
  VectorXd residual(StageEquations& of, const VectorXd& at_y, const VectorXd& at_a, const VectorXd& at_lambda) const {
    VectorXd r(StageEquations::count(mechanism.data()));
    of.place_at(t, at_y, angles, at_a, at_lambda);
    of.residual(r);
    return r;
  }
};

// Q = -K q - C v of two bodies at once, both matrices full.
struct FullPair final : UserForce {
  MatrixXd stiffness = MatrixXd::Random(14, 14), damping = MatrixXd::Random(14, 14);
  std::vector<std::string> bodies() const override { return {"rocker", "crank"}; }
  void Q(double, VecIn q, VecIn v, VecIn, VecOut out) const override { out = -stiffness * q - damping * v; }
  void K(double, VecIn, VecIn, VecIn, MatOut out) const override { out = stiffness; }
  void C(double, VecIn, VecIn, VecIn, MatOut out) const override { out = damping; }
  void Q_rho(double, VecIn, VecIn, VecIn, MatOut) const override {}
};

// The ground second in its joints, a gear whose row both of two hinges share, and a force on two bodies.
Place geared_four_bar(const FormulationSettings& formulation = {}) {
  Scene scene = spatial_four_bar();
  scene.joints.back() = hinge("D", "rocker", vec("0", "0", "0"), "ground", vec("dx", "0", "dz"));
  scene.joints.back().axis1 = vec("w", "0", "1"), scene.joints.back().axis2 = vec("0.1", "w", "1");
  scene.joints.back().normal1 = vec("1", "0", "n"), scene.joints.back().normal2 = vec("1", "n", "0");
  scene.bodies.push_back(body("wheel", vec("0.05", "0.02", "0"), vec("0.1", "0.2", "0.1"), turned("0.4")));
  Joint axle = hinge("E", "crank", vec("c1", "0", "0.1"), "wheel", vec("0", "0", "0"));
  axle.normal1 = vec("1", "0", "0"), axle.normal2 = vec("1", "0", "0");
  scene.joints.push_back(axle);
  Joint gear;
  gear.name = "gear", gear.type = "gear", gear.joint1 = "A", gear.joint2 = "E", gear.ratio = f("-1.7*n");
  scene.joints.push_back(gear);
  return Place(std::move(scene), {std::make_shared<FullPair>()}, formulation);
}

Place moving_four_bar(const FormulationSettings& formulation = {}) {
  Scene scene = every_force_four_bar();
  const auto drag = std::make_shared<CubicDrag>("coupler", static_cast<Index>(scene.parameters.size()) - 1);
  return Place(std::move(scene), {drag}, formulation);
}

}  // namespace

TEST_CASE("the residual vanishes at the solved accelerations and multipliers", "[equations]") {
  const FormulationSettings formulation = GENERATE(FormulationSettings{}, stabilised_penalty());
  Place p = moving_four_bar(formulation);
  const VectorXd r = p.residual(p.equations, p.y, p.a, p.lambda);
  CHECK(r.cwiseAbs().maxCoeff() < 1e-9 * (1 + p.lambda.cwiseAbs().maxCoeff()));
}

TEST_CASE("the residual's tangent in state and parameters is its difference", "[equations]") {
  const FormulationSettings formulation = GENERATE(FormulationSettings{}, stabilised_penalty());
  Place p = moving_four_bar(formulation);
  p.move();
  const Index states = p.y.size(), P = p.mechanism.parameters();
  p.residual(p.equations, p.y, p.a, p.lambda);
  LaneRows direction = LaneRows::Random(states, kLanes),
           change = LaneRows::Zero(StageEquations::count(p.mechanism.data()), kLanes);
  for (const ParameterBlock& block : parameter_blocks(p.mechanism.data())) {
    p.residual(p.equations, p.y, p.a, p.lambda);
    p.equations.tangent(block, direction, change);
    for (int lane = 0; lane < kLanes; ++lane) {
      auto at = [&](double h) {
        VectorXd rho = nominal(p.scene);
        if (block.parameter[lane] >= 0) rho(block.parameter[lane]) += h;
        const Mechanism moved(p.scene, rho, {}, p.forces);
        SpatialDynamics dynamics(moved, formulation);
        StageEquations equations(dynamics);
        return p.residual(equations, p.y + h * direction.col(lane), p.a, p.lambda);
      };
      const double h = 1e-3;
      const VectorXd d1 = (at(h) - at(-h)) / (2 * h), d2 = (at(h / 2) - at(-h / 2)) / h,
                     d4 = (at(h / 4) - at(-h / 4)) / (h / 2);
      const VectorXd difference = (64 * d4 - 20 * d2 + d1) / 45;
      INFO("parameter " << block.parameter[lane] << " of " << P);
      CHECK((difference - change.col(lane)).norm() < 1e-8 * (1 + change.col(lane).norm()));
    }
  }
}

TEST_CASE("the residual's adjoint is the transpose of its tangent", "[equations]") {
  const FormulationSettings formulation = GENERATE(FormulationSettings{}, stabilised_penalty());
  Place p = moving_four_bar(formulation);
  p.move();
  const MechanismData& data = p.mechanism.data();
  p.residual(p.equations, p.y, p.a, p.lambda);
  const VectorXd r_bar = VectorXd::Random(StageEquations::count(p.mechanism.data()));
  VectorXd y_bar = VectorXd::Zero(p.y.size()), theta_bar = VectorXd::Zero(data.slots()),
           rho_bar = VectorXd::Zero(data.rho.size());
  p.equations.add_adjoint(r_bar, y_bar, theta_bar, rho_bar);
  data.add_to_rho(theta_bar, rho_bar);
  LaneRows direction = LaneRows::Random(p.y.size(), kLanes),
           change = LaneRows::Zero(StageEquations::count(p.mechanism.data()), kLanes);
  for (const ParameterBlock& block : parameter_blocks(data)) {
    p.equations.tangent(block, direction, change);
    for (int lane = 0; lane < kLanes; ++lane) {
      double expected = y_bar.dot(direction.col(lane));
      if (block.parameter[lane] >= 0) expected += rho_bar(block.parameter[lane]);
      CHECK(r_bar.dot(change.col(lane)) == Approx(expected).epsilon(1e-11).margin(1e-9));
    }
  }
}

TEST_CASE("the sparse Jacobian has the residual's derivatives in q, v, a and lambda", "[equations]") {
  Place p = [] {
    switch (GENERATE(0, 1, 2, 3, 4)) {
      case 0:
        return moving_four_bar();
      case 1:
        return moving_four_bar(stabilised_penalty());
      case 2:
        return geared_four_bar();
      case 3:
        return geared_four_bar(stabilised_penalty());
      default:
        return Place(n_four_bar(3));
    }
  }();
  p.move();
  const int n = 7 * p.mechanism.data().n, m = p.mechanism.data().m;
  p.residual(p.equations, p.y, p.a, p.lambda);
  MotionJacobian jacobian(p.mechanism.data());
  MotionJacobian::Values values = jacobian.values();
  jacobian.evaluate(p.equations, values);
  MatrixXd found = MatrixXd::Zero(n + m, 3 * n + m);  // minus the derivative in (q, v, a, lambda)
  for (std::size_t k = 0; k < jacobian.pairs().size(); ++k) {
    const auto& [row, body] = jacobian.pairs()[k];
    found.block<7, 7>(7 * row, 7 * body) = values.q[k];
    found.block<7, 7>(7 * row, n + 7 * body) = values.v[k];
  }
  for (std::size_t k = 0; k < jacobian.rows().size(); ++k) {
    const auto& [row, body] = jacobian.rows()[k];
    found.block<1, 7>(n + row, 7 * body) = values.row_q[k];
    found.block<1, 7>(n + row, n + 7 * body) = values.row_v[k];
    found.block<1, 7>(n + row, 2 * n + 7 * body) = values.J_Z[k];
    found.block<6, 1>(7 * body, 3 * n + row) = values.J[k].transpose();
  }
  for (int i = 0; i < n / 7; ++i) found.block<7, 7>(7 * i, 2 * n + 7 * i) = values.mass[static_cast<std::size_t>(i)];
  for (int r = 0; r < m; ++r) found(n + r, 3 * n + r) = -values.compliance;

  // Rows by the adjoint, which knows nothing of blocks.
  VectorXd theta_bar = VectorXd::Zero(p.mechanism.data().slots()), rho_bar = VectorXd::Zero(p.mechanism.parameters());
  for (int r = 0; r < n + m; ++r) {
    VectorXd y_bar = VectorXd::Zero(2 * n);
    p.equations.add_adjoint(VectorXd::Unit(n + m, r), y_bar, theta_bar, rho_bar);
    INFO("row " << r);
    CHECK((found.row(r).head(2 * n).transpose() + y_bar).cwiseAbs().maxCoeff() <
          1e-12 * (1 + y_bar.cwiseAbs().maxCoeff()));
  }
  // The residual is linear in (a, lambda).
  const VectorXd r = p.residual(p.equations, p.y, p.a, p.lambda);
  for (int c = 0; c < n + m; ++c) {
    VectorXd a = p.a, lambda = p.lambda;
    (c < n ? a(c) : lambda(c - n)) += 1;
    const VectorXd column = p.residual(p.equations, p.y, a, lambda) - r;
    INFO("column " << 2 * n + c);
    CHECK((found.col(2 * n + c) + column).cwiseAbs().maxCoeff() < 1e-9 * (1 + r.cwiseAbs().maxCoeff()));
  }
}
