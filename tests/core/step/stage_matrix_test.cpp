// The system of coupled stages against the same matrix written out densely.
#include "core/step/stage_matrix.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "core/start/assembly.hpp"
#include "tests/core/mechanism/moving_scenes.hpp"

using namespace mbsopt;
using namespace mbsopt::testing;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd dense(const MotionJacobian& jacobian, const MatrixXd& P, const std::vector<MotionJacobian::Values>& values) {
  const Index s = P.rows(), n = 7 * jacobian.bodies(), per = n + jacobian.constraints();
  const MatrixXd P2 = P * P;
  MatrixXd N = MatrixXd::Zero(s * per, s * per);
  for (Index i = 0; i < s; ++i) {
    const MotionJacobian::Values& x = values[static_cast<std::size_t>(i)];
    for (Index j = 0; j < s; ++j) {
      auto block = N.block(i * per, j * per, per, per);
      for (std::size_t k = 0; k < x.q.size(); ++k) {
        const auto [row, body] = jacobian.pairs()[k];
        block.block<7, 7>(7 * row, 7 * body) += P(i, j) * x.v[k] + P2(i, j) * x.q[k];
      }
      for (std::size_t k = 0; k < x.row_q.size(); ++k) {
        const auto [row, body] = jacobian.rows()[k];
        block.block<1, 7>(n + row, 7 * body) += P(i, j) * x.row_v[k] + P2(i, j) * x.row_q[k];
        if (i != j) continue;
        block.block<1, 7>(n + row, 7 * body) += x.J_Z[k];
        block.block<6, 1>(7 * body, n + row) += x.J[k].transpose();
      }
      if (i != j) continue;
      for (int b = 0; b < jacobian.bodies(); ++b) {
        block.block<7, 7>(7 * b, 7 * b) += x.mass[static_cast<std::size_t>(b)];
      }
      block.bottomRightCorner(jacobian.constraints(), jacobian.constraints()).diagonal().array() -= x.compliance;
    }
  }
  return N;
}

struct Moving {
  Scene scene;
  Mechanism mechanism;
  MotionJacobian jacobian;
  std::vector<MotionJacobian::Values> values;  // at as many states, a little apart

  Moving(const Scene& of, int states) : scene(of), mechanism(scene, nominal(scene)), jacobian(mechanism.data()) {
    const Assembly assembly(mechanism, 0);
    REQUIRE(assembly.result().ok);
    const VectorXd& angles = assembly.result().angles;
    VectorXd y = assembly.result().y, ydot(y.size());
    SpatialDynamics dynamics(mechanism, scene.simulation.formulation);
    StageEquations equations(dynamics);
    for (int k = 0; k < states; ++k) {
      REQUIRE(dynamics.evaluate(0, y, angles, ydot));
      equations.place_at(0, y, angles, ydot.tail(y.size() / 2), VectorXd(dynamics.lambda()));
      values.push_back(jacobian.values());
      jacobian.evaluate(equations, values.back());
      y += 0.01 * ydot;
    }
  }
};

void check_solves(StageMatrix& matrix, const MatrixXd& N, double tolerance) {
  const MatrixXd b = MatrixXd::Random(N.rows(), 3);
  MatrixXd x = b;
  matrix.solve(x, StageMatrix::kExact);
  CHECK((N * x - b).norm() < tolerance * N.norm() * x.norm());
  x = b;
  matrix.solve_transposed(x, StageMatrix::kExact);
  CHECK((N.transpose() * x - b).norm() < tolerance * N.norm() * x.norm());
}

}  // namespace

TEST_CASE("coupled stages are solved by blocks, and transposed", "[stage_matrix]") {
  const int stages = GENERATE(1, 2, 3, 4);
  const Moving moving(every_force_four_bar(), stages);
  const MatrixXd P = 0.01 * (MatrixXd::Random(stages, stages) + 2 * MatrixXd::Identity(stages, stages));
  StageMatrix matrix(moving.mechanism.data(), moving.jacobian, stages);
  REQUIRE(matrix.factor(1, P, moving.values));
  CHECK(matrix.pivoted() == 0);
  check_solves(matrix, dense(moving.jacobian, P, moving.values), 1e-14);
}

TEST_CASE("more stages than blocks are made for go to the sparse LU", "[stage_matrix]") {
  constexpr int kStages = 5;
  const Moving moving(loaded_four_bar(), kStages);
  const MatrixXd P = 0.01 * (MatrixXd::Random(kStages, kStages) + 2 * MatrixXd::Identity(kStages, kStages));
  StageMatrix matrix(moving.mechanism.data(), moving.jacobian, kStages);
  REQUIRE(matrix.factor(1, P, moving.values));
  CHECK(matrix.pivoted() == 1);
  check_solves(matrix, dense(moving.jacobian, P, moving.values), 1e-14);
}

TEST_CASE("where blocks give a wrong answer, the sparse LU does not", "[stage_matrix]") {
  const double s = GENERATE(0.0, 1e-17);
  Moving moving(loaded_four_bar(), 1);
  MotionJacobian::Values& x = moving.values.front();
  // A velocity-dependent force that swaps what two bodies feel, and no inertia: zero pivots but for rounding.
  for (auto& mass : x.mass) mass.setZero();
  for (std::size_t k = 0; k < x.v.size(); ++k) {
    const auto [row, body] = moving.jacobian.pairs()[k];
    x.q[k].setZero(), x.v[k].setZero();
    if (row == body) x.v[k].diagonal().setConstant(body < 2 ? s : 1.0);
    if (row < 2 && body < 2 && row != body) x.v[k].setIdentity();
  }
  for (auto* rows : {&x.row_q, &x.row_v, &x.J_Z}) {
    for (auto& row : *rows) row.setZero();
  }
  for (auto& row : x.J) row.setZero();
  x.compliance = 1;
  const MatrixXd P = MatrixXd::Identity(1, 1);
  StageMatrix matrix(moving.mechanism.data(), moving.jacobian, 1);
  REQUIRE(matrix.factor(1, P, moving.values));
  CHECK(matrix.pivoted() == 1);
  check_solves(matrix, dense(moving.jacobian, P, moving.values), 1e-14);
}

// The units of lengths, masses and times change no digit of a factor.
TEST_CASE("a mechanism of micrometres is solved as well as one of metres", "[stage_matrix]") {
  const double size = GENERATE(1e-6, 1.0, 1e4);
  INFO(size << " m");
  const auto sized = [&](double x, double y, double z) { return VectorField{size * x, size * y, size * z}; };
  Scene scene;
  scene.gravity = sized(0, 0, -9.81);
  Body bar =
      body("bar", sized(0, 0, 0), sized(0.3, 1.4, -0.4), AxisAngleField{vec("-0.025", "-0.18", "-0.98"), f("2")});
  bar.mass = size * size * size;
  const double inertia = std::pow(size, 5);
  bar.inertia = {0.3 * inertia, 0.3 * inertia, 0.5 * inertia, 0.0, 0.0, 0.0};
  bar.angular_velocity = vec("-1.4", "-1", "2.5");
  scene.bodies.push_back(bar);
  Joint pin;
  pin.name = "pin", pin.type = "revolute", pin.body1 = "ground", pin.body2 = "bar";
  pin.point1 = sized(-0.3, 0.7, -0.2), pin.point2 = sized(1, 0.26, -0.08);
  pin.axis1 = vec("-0.46", "-0.32", "0.83"), pin.axis2 = vec("0.68", "0.19", "0.7");
  scene.joints.push_back(pin);
  const Moving moving(scene, 3);
  MatrixXd P(3, 3);
  P << 0.2, -0.07, 0.02, 0.4, 0.3, -0.04, 0.38, 0.5, 0.11;  // about Radau IIA's
  P *= 1e-2;
  StageMatrix matrix(moving.mechanism.data(), moving.jacobian, 3);
  REQUIRE(matrix.factor(1, P, moving.values));
  VectorXd b = VectorXd::Zero(matrix.size());
  for (Index i = 0; i < 3; ++i) b.segment<3>(i * matrix.size() / 3 + 3) = inertia * Vector3d(1, 2, -1);
  MatrixXd once = b, exact = b;
  matrix.solve(once, 0);
  matrix.solve(exact, StageMatrix::kExact);
  for (Index i = 0; i < 3; ++i) {
    const Index p = i * matrix.size() / 3 + 3;
    CHECK((once - exact).middleRows<4>(p).norm() < 1e-6 * exact.middleRows<4>(p).norm());
  }
}
