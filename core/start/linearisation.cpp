#include "core/start/linearisation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "core/body/state_layout.hpp"
#include "core/dynamics/acceleration_tangents.hpp"
#include "core/dynamics/motion_solver.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/linear/dense.hpp"
#include "core/start/assembly_equations.hpp"

namespace mbsopt {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The size of the mechanism: the largest distance of a centre of mass from the first one, or from the origin.
double size_of(const VectorXd& y, int n) {
  const StateLayout layout{n};
  double apart = 0, away = 0;
  for (int i = 1; i <= n; ++i) {
    apart = std::max(apart, (y.segment<3>(layout.q(i)) - y.segment<3>(layout.q(1))).norm());
    away = std::max(away, y.segment<3>(layout.q(i)).norm());
  }
  return apart > 0 ? apart : away > 0 ? away : 1.0;
}

// The free directions N and P, and the derivatives of the constraints in the inputs. `unit` holds those of q.
struct FreeDirections {
  MatrixXd N, P, phi_rho;
};

FreeDirections free_directions(const MechanismData& d, const StatePoint& at, const VectorXd& unit) {
  AssemblyEquations position(d, AssemblyLevel::position, at.t), velocity(d, AssemblyLevel::velocity, at.t);
  position.start_branches(at.y);
  velocity.start_branches(at.y);
  const Index rows = d.m + d.n, half = unit.size();  // without conditions on sensors
  const AssemblyEquations::Gradients F = position.gradients(at.y), G = velocity.gradients(at.y);
  const UnitRows J(F.y.topLeftCorner(rows, half) * unit.asDiagonal());
  const MatrixXd J_dot = J.scale.asDiagonal() * G.y.topLeftCorner(rows, half) * unit.asDiagonal();
  FreeDirections x;
  x.N = null_space(J.J, UnitRows::kRankThreshold);
  x.P = -OrthogonalDecomposition(J.J, UnitRows::kRankThreshold).solve(J_dot * x.N);
  x.phi_rho = F.rho.topRows(rows).cwiseAbs() + G.rho.topRows(rows).cwiseAbs();
  return x;
}

// Eigenvalues in a unit of 1/time in which the largest acceleration of a unit displacement is 1. Then no entry of A
// hides another by its unit.
void add_eigenvalues(Linearisation& x) {
  const Index f = x.A.rows() / 2;
  if (f == 0) return;
  const double stiffness = x.A.bottomLeftCorner(f, f).norm(), damping = x.A.bottomRightCorner(f, f).norm();
  const double fastest = std::max(std::sqrt(stiffness), damping), per_time = fastest > 0 ? fastest : 1.0;
  MatrixXd A = x.A / per_time;
  A.topRightCorner(f, f).setIdentity();
  A.bottomLeftCorner(f, f) /= per_time;
  const GeneralEigen eigen = general_eigen(A);
  std::vector<Index> order(static_cast<std::size_t>(2 * f));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),  // keeps pairs together
                   [&](Index i, Index j) { return std::abs(eigen.values(i)) < std::abs(eigen.values(j)); });
  x.eigenvalues.resize(2 * f);
  x.errors.resize(2 * f);
  x.modes.resize(x.basis.rows(), 2 * f);
  for (Index k = 0; k < 2 * f; ++k) {
    const Index i = order[static_cast<std::size_t>(k)];
    x.eigenvalues(k) = per_time * eigen.values(i);
    // A double eigenvalue with one eigenvector (a free motion: 0) has an error of at most sqrt(epsilon).
    const double rounding = A.norm() * std::numeric_limits<double>::epsilon();
    x.errors(k) = per_time * std::min(std::sqrt(rounding), rounding * eigen.conditions(i));
    Eigen::VectorXcd z = eigen.vectors.col(i);
    z.tail(f) *= per_time;
    x.modes.col(k) = (x.basis * z).normalized();
  }
}

void add_outputs(const Mechanism& mechanism, const FormulationSettings& formulation, const StatePoint& at,
                 const std::vector<int>& inputs, const std::vector<int>& outputs, Linearisation& x) {
  MotionSolver motion(mechanism, formulation);
  const StatePoint with_motion{at.t, at.y, at.angles, &motion};
  x.C.resize(static_cast<Index>(outputs.size()), x.A.cols());
  x.D.resize(x.C.rows(), static_cast<Index>(inputs.size()));
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    VectorXd y_bar = VectorXd::Zero(at.y.size()), rho_bar = VectorXd::Zero(mechanism.parameters());
    mechanism.add_sensor_gradient(outputs[o], with_motion, 1, y_bar, rho_bar);
    x.C.row(static_cast<Index>(o)) = y_bar.transpose() * x.basis;
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      x.D(static_cast<Index>(o), static_cast<Index>(k)) = rho_bar(inputs[k]);
    }
  }
}

}  // namespace

Linearisation linearise(const Mechanism& mechanism, const FormulationSettings& formulation, const StatePoint& at,
                        const std::vector<int>& inputs, const std::vector<int>& outputs) {
  const MechanismData& d = mechanism.data();
  const StateLayout layout{d.n};
  const Index half = layout.positions();
  SpatialDynamics dynamics(mechanism, formulation);
  VectorXd ydot(at.y.size());
  if (!dynamics.evaluate(at.t, at.y, at.angles, ydot))
    throw std::invalid_argument("the accelerations of this state cannot be computed");
  dynamics.linearise_here();

  Linearisation x;
  x.length = size_of(at.y, d.n);
  VectorXd unit = VectorXd::Ones(half);
  for (int i = 1; i <= d.n; ++i) unit.segment<3>(layout.q(i)).setConstant(x.length);
  const FreeDirections free = free_directions(d, at, unit);
  const Index f = free.N.cols();
  for (const int k : inputs) {
    if (!free.phi_rho.col(k).isZero(0))
      throw std::invalid_argument(
          "the input moves the joints or drives; only what acts through forces, masses or "
          "inertias can be an input");
  }
  x.basis = MatrixXd::Zero(2 * half, 2 * f);
  x.basis.topLeftCorner(half, f) = x.basis.bottomRightCorner(half, f) = unit.asDiagonal() * free.N;
  x.basis.bottomLeftCorner(half, f) = unit.asDiagonal() * free.P;
  const MatrixXd to_z = free.N.transpose() * unit.cwiseInverse().asDiagonal();

  x.A = MatrixXd::Zero(2 * f, 2 * f);
  x.A.topRightCorner(f, f).setIdentity();
  x.A.bottomRows(f) = to_z * acceleration_tangents(dynamics, x.basis);
  x.A.bottomLeftCorner(f, f) += free.P.transpose() * free.P;
  const MatrixXd a_rho = acceleration_of_parameters(dynamics);
  x.B = MatrixXd::Zero(2 * f, static_cast<Index>(inputs.size()));
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    x.B.col(static_cast<Index>(k)).tail(f) = to_z * a_rho.col(inputs[k]);
  }
  add_outputs(mechanism, formulation, at, inputs, outputs, x);
  add_eigenvalues(x);

  for (int i = 1; i <= d.n; ++i) {
    x.largest_rate = std::max(
        {x.largest_rate, at.y.segment<3>(layout.v(i)).norm() / x.length, 2 * at.y.segment<4>(layout.pdot(i)).norm()});
  }
  // N'a + A21 d = 0
  const MatrixXd stiffness = x.A.bottomLeftCorner(f, f);
  const VectorXd accelerates = to_z * ydot.tail(half);
  const VectorXd displacement = OrthogonalDecomposition(stiffness).solve(-accelerates);
  x.distance = displacement.norm();
  x.free_acceleration = (accelerates + stiffness * displacement).norm();
  x.gravity = d.gravity.norm() / x.length;
  return x;
}

Eigen::MatrixXcd transfer(const Linearisation& x, std::complex<double> s) {
  Eigen::MatrixXcd left = -x.A;
  left.diagonal().array() += s;
  return x.C * regular_solve(left, x.B) + x.D;
}

bool is_equilibrium(const Linearisation& x) {
  constexpr double kAtRest = 1e-6;  // an equilibrium is found to 1e-11 of the length
  const double fastest = x.eigenvalues.size() > 0 ? x.eigenvalues.cwiseAbs().maxCoeff() : 0.0;
  return x.distance <= kAtRest && x.free_acceleration <= kAtRest * std::max(fastest * fastest, x.gravity) &&
         x.largest_rate <= kAtRest * fastest;
}

double frequency(std::complex<double> eigenvalue) { return std::abs(eigenvalue) / (2 * std::numbers::pi); }

double damping_ratio(std::complex<double> eigenvalue) {
  const double size = std::abs(eigenvalue);
  return size > 0 ? -eigenvalue.real() / size : 0.0;
}

}  // namespace mbsopt
