// The equations of motion at single states: against a dense solution of the constrained equations, and their tangent
// and adjoint against differences and against each other, at states off the constraints and off the unit sphere.
#include "core/dynamics/spatial_dynamics.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "core/body/euler_parameters.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kTime = 0.37;

// Anywhere near the guess, unit norms violated as well.
VectorXd state(const Mechanism& mechanism, unsigned seed) {
  std::srand(seed);
  const MechanismData& d = mechanism.data();
  VectorXd y = 0.3 * VectorXd::Random(14 * d.n);
  for (int i = 1; i <= d.n; ++i) y.segment<7>(7 * (i - 1)) += d.bodies[static_cast<std::size_t>(i)].q;
  return y;
}

FormulationSettings formulation(const std::string& name) {
  FormulationSettings s;
  if (name == "penalty") {
    s = FormulationSettings::penalty();
    s.alpha = 1e2;  // rounding errors grow with alpha: so differences keep their digits
  } else if (name == "quasidefinite") {
    s = FormulationSettings::penalty();
    s.linear_solver = LinearSolver::quasidefinite;
  } else if (name == "stabilised") {
    s.omega = 7, s.xi = 0.8;
  }
  return s;
}

VectorXd ydot(const Mechanism& mechanism, const FormulationSettings& settings, const VectorXd& y,
              const VectorXd& angles) {
  SpatialDynamics dynamics(mechanism, settings);
  VectorXd out(y.size());
  REQUIRE(dynamics.evaluate(kTime, y, angles, out));
  return out;
}

std::vector<std::shared_ptr<const UserForce>> user_forces(const Scene& scene) {
  return {std::make_shared<CubicDrag>("coupler", static_cast<Eigen::Index>(scene.parameters.size()) - 1)};
}

}  // namespace

TEST_CASE("accelerations of a free body follow Euler's equations", "[dynamics]") {
  Scene scene;
  Body b = body("top", vec("0", "0", "0"), vec("1", "2", "3"), RollPitchYawField{vec("0.3", "-0.2", "0.9")});
  scene.bodies.push_back(b);
  const Mechanism mechanism(scene, VectorXd());
  const VectorXd y = [&] {
    VectorXd x = state(mechanism, 3);
    x.segment<4>(3).normalize();
    const Vector4d p = x.segment<4>(3);
    x.segment<4>(10) -= p * p.dot(x.segment<4>(10));
    return x;
  }();
  const VectorXd rate = ydot(mechanism, {}, y, VectorXd());
  const Vector4d p = y.segment<4>(3), pdot = y.segment<4>(10);
  const Matrix3d& J = mechanism.data().bodies[1].J;
  const Vector3d omega = omega_B(p, pdot), omegadot = 2 * G_times(p, rate.segment<4>(10));
  CHECK((J * omegadot + omega.cross(J * omega)).norm() < 1e-13);
  CHECK((rate.segment<3>(7) - Vector3d(0, 0, -9.81)).norm() < 1e-14);
  CHECK(std::abs(p.dot(rate.segment<4>(10)) + pdot.squaredNorm()) < 1e-14);
}

TEST_CASE("the augmented Lagrangian reaches the constrained equations whatever its alpha", "[dynamics]") {
  const Scene scene = every_force_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  const VectorXd y = state(mechanism, 5), angles = VectorXd::Zero(1);
  FormulationSettings settings;
  settings.iterations = 40;
  settings.alpha = GENERATE(1e3, 1e5, 1e7, 1e9, 1e11);
  SpatialDynamics dynamics(mechanism, settings);
  VectorXd rate(y.size());
  REQUIRE(dynamics.evaluate(kTime, y, angles, rate));
  // J z + gamma = 0 and M z + J'lambda = f, residuals against the size of their terms
  const ConstraintRows& rows = dynamics.solver().rows();
  VectorXd Jz = VectorXd::Zero(d.m);
  rows.subtract_times(dynamics.z(), Jz);
  FormulationSettings reference = settings;
  reference.alpha = 1e6;
  const VectorXd expected = ydot(mechanism, reference, y, angles);
  const double size = expected.cwiseAbs().maxCoeff();
  INFO("alpha " << settings.alpha);
  CHECK((rate - expected).cwiseAbs().maxCoeff() < 1e-11 * size);
  CHECK(Jz.cwiseAbs().maxCoeff() > 0.1);  // there is something to satisfy
}

TEST_CASE("accelerations equal a dense solution of the constrained equations", "[dynamics]") {
  const Scene scene = spatial_four_bar();
  const Mechanism mechanism(scene, nominal(scene));
  const MechanismData& d = mechanism.data();
  const VectorXd y = state(mechanism, 7);
  const VectorXd angles = VectorXd::Zero(1);
  SpatialDynamics dynamics(mechanism, {});
  VectorXd rate(y.size());
  REQUIRE(dynamics.evaluate(kTime, y, angles, rate));
  // Dense: M, J from the rows; gamma by second differences of Phi along the motion with z = 0; planar loops are
  // redundant.
  std::vector<Frame> frames(4);
  const Vec<6> none = Vec<6>::Zero();
  for (int i = 1; i <= 3; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    set_position(y.segment<7>(7 * (i - 1)), frames[k]);
    set_velocity(y.segment<7>(21 + 7 * (i - 1)), frames[k]);
    set_acceleration(none, frames[k]);
  }
  VectorXd gamma(d.m);
  RowLaws laws(d);
  ConstraintTerms(d).phi_ddot(frames, laws, gamma);
  MatrixXd M = MatrixXd::Zero(18, 18);
  VectorXd f = VectorXd::Zero(18);
  for (int i = 1; i <= 3; ++i) {
    const BodyData& b = d.bodies[static_cast<std::size_t>(i)];
    M.block<3, 3>(6 * i - 6, 6 * i - 6) = b.mass * Matrix3d::Identity();
    M.block<3, 3>(6 * i - 3, 6 * i - 3) = b.J;
    const Vector3d omega = frames[static_cast<std::size_t>(i)].omega();
    f.segment<3>(6 * i - 6) = b.mass * d.gravity;
    f.segment<3>(6 * i - 3) = -omega.cross(b.J * omega);
  }
  MatrixXd J;
  dynamics.solver().rows().write_dense(J);
  MatrixXd KKT = MatrixXd::Zero(18 + d.m, 18 + d.m);
  KKT.topLeftCorner(18, 18) = M;
  KKT.topRightCorner(18, d.m) = J.transpose();
  KKT.bottomLeftCorner(d.m, 18) = J;
  VectorXd rhs(18 + d.m);
  rhs << f, -gamma;
  const VectorXd x = KKT.fullPivLu().solve(rhs);
  for (int i = 0; i < 3; ++i) {
    CHECK((x.segment<6>(6 * i) - dynamics.z()[static_cast<std::size_t>(i)]).norm() < 1e-9 * x.head(18).norm());
  }
}

TEST_CASE("tangent of the accelerations equals central differences, in the state and in every parameter",
          "[dynamics]") {
  const Scene scene = every_force_four_bar();
  const std::string form =
      GENERATE(as<std::string>{}, "augmented_lagrangian", "stabilised", "penalty", "quasidefinite");
  const FormulationSettings settings = formulation(form);
  const VectorXd rho = nominal(scene);
  const Mechanism mechanism(scene, rho, {}, user_forces(scene));
  const VectorXd y = state(mechanism, 11), angles = VectorXd::Constant(1, 0.5);
  SpatialDynamics dynamics(mechanism, settings);
  VectorXd rate(y.size());
  REQUIRE(dynamics.evaluate(kTime, y, angles, rate));
  dynamics.linearise_here();
  const double size = rate.cwiseAbs().maxCoeff(), h = 1e-6;
  INFO(form);

  std::srand(2);
  LaneRows direction = LaneRows::Random(y.size(), kLanes), out(y.size(), kLanes);
  const ParameterBlock none = block_without_parameters(mechanism.data());
  dynamics.tangent(none, direction, out);
  for (int k = 0; k < kLanes; ++k) {
    const VectorXd e = direction.col(k);
    const VectorXd difference =
        (ydot(mechanism, settings, y + h * e, angles) - ydot(mechanism, settings, y - h * e, angles)) / (2 * h);
    CHECK((difference - out.col(k)).cwiseAbs().maxCoeff() < 1e-7 * std::max(size, out.cwiseAbs().maxCoeff()));
  }

  direction.setZero();
  for (const ParameterBlock& block : parameter_blocks(mechanism.data())) {
    dynamics.tangent(block, direction, out);
    for (int k = 0; k < kLanes; ++k) {
      if (block.parameter[k] < 0) continue;
      VectorXd up = rho, down = rho;
      up(block.parameter[k]) += h, down(block.parameter[k]) -= h;
      const VectorXd difference = (ydot(Mechanism(scene, up, {}, user_forces(scene)), settings, y, angles) -
                                   ydot(Mechanism(scene, down, {}, user_forces(scene)), settings, y, angles)) /
                                  (2 * h);
      INFO(scene.parameters[static_cast<std::size_t>(block.parameter[k])].name);
      CHECK((difference - out.col(k)).cwiseAbs().maxCoeff() < 1e-7 * std::max(size, out.cwiseAbs().maxCoeff()));
    }
  }
}

TEST_CASE("the adjoint of the accelerations is the transpose of their tangent", "[dynamics]") {
  const Scene scene = every_force_four_bar();
  const FormulationSettings settings =
      formulation(GENERATE(as<std::string>{}, "augmented_lagrangian", "stabilised", "penalty", "quasidefinite"));
  const Mechanism mechanism(scene, nominal(scene), {}, user_forces(scene));
  const MechanismData& d = mechanism.data();
  const VectorXd y = state(mechanism, 13), angles = VectorXd::Constant(1, 0.5);
  SpatialDynamics dynamics(mechanism, settings);
  VectorXd rate(y.size());
  REQUIRE(dynamics.evaluate(kTime, y, angles, rate));
  // A second one, prepared from the stored solution, must give the same.
  SpatialDynamics again(mechanism, settings);
  REQUIRE(again.linearise(kTime, y, angles, rate.tail(y.size() / 2), dynamics.lambda()));
  const VectorXd w = VectorXd::Random(y.size());
  VectorXd y_bar = VectorXd::Zero(y.size()), theta_bar = VectorXd::Zero(d.slots()),
           rho_bar = VectorXd::Zero(d.rho.size());
  again.add_adjoint(w, y_bar, theta_bar, rho_bar);
  d.add_to_rho(theta_bar, rho_bar);

  dynamics.linearise_here();
  for (const ParameterBlock& block : parameter_blocks(d)) {
    const LaneRows direction = LaneRows::Random(y.size(), kLanes);
    LaneRows out(y.size(), kLanes);
    dynamics.tangent(block, direction, out);
    for (int k = 0; k < kLanes; ++k) {
      const double forward = w.dot(out.col(k));
      const double backward = y_bar.dot(direction.col(k)) + (block.parameter[k] < 0 ? 0 : rho_bar(block.parameter[k]));
      CHECK(std::abs(forward - backward) < 1e-12 * (w.cwiseAbs().dot(out.col(k).cwiseAbs())));
    }
  }
}
