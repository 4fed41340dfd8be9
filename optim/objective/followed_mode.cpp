#include "optim/objective/followed_mode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "core/body/state_layout.hpp"
#include "core/dynamics/spatial_dynamics.hpp"
#include "core/linear/dense.hpp"
#include "core/start/assembly.hpp"
#include "optim/differences/difference_ladder.hpp"
#include "optim/objective/one_to_one.hpp"
#include "optim/problem/parameter_values.hpp"

namespace mbsopt::inline optim {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

struct FollowedMode::State {
  Mechanism mechanism;
  Assembly assembly;
  FormulationSettings formulation;
  Linearisation x;
  double t;

  State(const Scene& scene, const VectorXd& rho, const UserForces& forces, bool derivatives)
      : mechanism(scene, rho, std::vector<bool>(scene.parameters.size(), derivatives), forces),
        assembly(mechanism, scene.simulation.start_time),
        formulation(scene.simulation.formulation),
        t(scene.simulation.start_time) {
    if (!assembly.result().ok) throw std::runtime_error(assembly.result().message);
    x = linearise(mechanism, formulation, {t, y(), angles()}, {}, {});
    if (!is_equilibrium(x))
      throw std::runtime_error("the initial state is no equilibrium, so it has no modes: set initial.equilibrium");
  }
  const VectorXd& y() const { return assembly.result().y; }
  const VectorXd& angles() const { return assembly.result().angles; }
  Index positions() const { return y().size() / 2; }
  // The units of y: lengths by the mechanism's size, rates by the mode's.
  VectorXd units(double rate) const {
    const StateLayout layout = StateLayout::of(y());
    VectorXd s = VectorXd::Ones(y().size());
    for (int k = 1; k <= layout.n; ++k) s.segment<3>(layout.q(k)).setConstant(x.length);
    s.tail(positions()) = rate * s.head(positions());
    return s;
  }
  std::vector<Index> modes() const {  // from slow to fast; one of each pair
    std::vector<Index> of;
    for (Index k = 0; k < x.eigenvalues.size(); ++k)
      if (x.eigenvalues(k).imag() >= 0) of.push_back(k);
    return of;
  }
  // The displacements of the modes without units, of unit length.
  Eigen::MatrixXcd shapes() const {
    Eigen::MatrixXcd shapes = x.modes(Eigen::seqN(0, positions()), modes());
    for (auto shape : shapes.colwise()) shape = shape.cwiseQuotient(units(1).head(positions())).normalized().eval();
    return shapes;
  }
};

struct FollowedMode::Reference {
  std::once_flag once;
  Eigen::MatrixXcd shapes;
};

FollowedMode::FollowedMode(const Scene& scene, const EigenvalueSpec& spec)
    : scene_(scene), spec_(spec), reference_(std::make_unique<Reference>()) {}
FollowedMode::~FollowedMode() = default;

Index FollowedMode::mode_of(const State& state, const UserForces& forces) const {
  const int number = spec_.mode.value_or(1);
  std::call_once(reference_->once, [&] {
    reference_->shapes = State(scene_, parameter_values(scene_), forces, false).shapes();
    if (reference_->shapes.cols() < number)
      throw std::runtime_error(
          fmt::format("there is no mode {}: the initial state has {}", number, reference_->shapes.cols()));
  });
  const std::vector<Index> modes = state.modes();
  const MatrixXd alike = (reference_->shapes.adjoint() * state.shapes()).cwiseAbs2();
  const Index found = one_to_one(alike)[static_cast<std::size_t>(number - 1)];
  if (found < 0)
    throw std::runtime_error(fmt::format("mode {} does not exist here: there are {} modes in place of {}", number,
                                         modes.size(), reference_->shapes.cols()));
  return modes[static_cast<std::size_t>(found)];
}

double FollowedMode::value_of(std::complex<double> lambda) const {
  return spec_.value.ends_with("frequency") ? frequency(lambda) : damping_ratio(lambda);
}

std::vector<Index> FollowedMode::modes_of(const State& state, const UserForces& forces) const {
  constexpr std::size_t kMost = 8;  // a step of a design does not lower more modes to the least one
  if (!is_least()) return {mode_of(state, forces)};
  std::vector<Index> modes = state.modes();
  if (modes.empty()) throw std::runtime_error("the initial state has no modes");
  std::ranges::stable_sort(modes, {}, [&](Index k) { return value_of(state.x.eigenvalues(k)); });
  modes.resize(std::min(modes.size(), kMost));
  return modes;
}

double FollowedMode::value(const VectorXd& rho, const UserForces& forces) const {
  const State state(scene_, rho, forces, false);
  return value_of(state.x.eigenvalues(modes_of(state, forces).front()));
}

int FollowedMode::number(const VectorXd& rho, const UserForces& forces) const {
  const State state(scene_, rho, forces, false);
  const std::vector<Index> modes = state.modes();
  return static_cast<int>(std::ranges::find(modes, mode_of(state, forces)) - modes.begin()) + 1;
}

namespace {

// f_y, column by column.
MatrixXd state_matrix(SpatialDynamics& dynamics) {
  const ParameterBlock none = block_without_parameters(dynamics.data());
  const Index states = StateLayout{dynamics.data().n}.size();
  MatrixXd F(states, states);
  LaneRows y_dir(states, kLanes), ydot_dir(states, kLanes);
  for (Index first = 0; first < states; first += kLanes) {
    const Index lanes = std::min<Index>(kLanes, states - first);
    y_dir.setZero();
    for (Index k = 0; k < lanes; ++k) y_dir(first + k, k) = 1;
    dynamics.tangent(none, y_dir, ydot_dir);
    F.middleCols(first, lanes) = ydot_dir.leftCols(lanes);
  }
  return F;
}

}  // namespace

std::vector<FollowedMode::Slope> FollowedMode::slopes(const VectorXd& rho, const UserForces& forces,
                                                      std::vector<std::string>* warnings) const {
  State state(scene_, rho, forces, true);
  const std::vector<Index> modes = modes_of(state, forces);
  const std::complex<double> lambda = state.x.eigenvalues(modes.front());
  for (Index k = 0; warnings && k < state.x.eigenvalues.size(); ++k) {
    constexpr double kSame = 1e-6;  // relative: closer ones turn into each other within a usual step of a design
    if (k != modes.front() && std::abs(state.x.eigenvalues(k) - lambda) <= kSame * std::abs(lambda))
      warnings->push_back("another mode has the same eigenvalue: neither has a derivative there");
  }
  std::vector<Slope> slopes;
  for (const Index mode : modes) slopes.push_back(slope(state, mode));
  return slopes;
}

FollowedMode::Slope FollowedMode::slope(State& state, Index mode) const {
  const std::complex<double> lambda = state.x.eigenvalues(mode);
  const double size = std::abs(lambda);
  if (size <= state.x.errors(mode))
    throw std::runtime_error("the mode is a free motion, whose eigenvalue 0 has no derivative");
  SpatialDynamics dynamics(state.mechanism, state.formulation);
  const MechanismData& d = dynamics.data();
  const VectorXd units = state.units(size);
  VectorXd ydot(units.size());
  const auto linearise_at = [&](const VectorXd& y) {
    if (!dynamics.evaluate(state.t, y, state.angles(), ydot)) return false;
    dynamics.linearise_here();
    return true;
  };
  if (!linearise_at(state.y())) throw std::runtime_error("the accelerations of this state cannot be computed");
  const MatrixXd F = units.cwiseInverse().asDiagonal() * state_matrix(dynamics) * units.asDiagonal();
  const VectorXcd v = state.x.modes.col(mode).cwiseQuotient(units).normalized();
  VectorXcd w = left_eigenvector(F, lambda);
  w /= std::conj(w.dot(v));  // w'v = 1
  const VectorXcd w_in_y = w.conjugate().cwiseQuotient(units), v_in_y = v.cwiseProduct(units);

  // Columns: the cotangents Re w, Im w; rows: (y, rho).
  const Index states = units.size(), P = d.rho.size();
  const auto adjoints = [&](const VectorXd& y) -> std::optional<VectorXd> {
    if (!linearise_at(y)) return std::nullopt;
    VectorXd out = VectorXd::Zero(2 * (states + P)), theta(d.slots()), of_rho(P);
    for (const int part : {0, 1}) {
      const VectorXd cotangent = part == 0 ? VectorXd(w_in_y.real()) : VectorXd(w_in_y.imag());
      theta.setZero();
      of_rho.setZero();
      dynamics.add_adjoint(cotangent, out.segment(part * (states + P), states), theta, of_rho);
      d.add_to_rho(theta, of_rho);
      out.segment(part * (states + P) + states, P) = of_rho;
    }
    return out;
  };
  // d(w'f_y)/d(y, rho) along u: of Re w and Im w.
  const auto along = [&](const VectorXd& u) {
    constexpr double kStep = 0.05;  // of the mechanism's size, or rad: the highest rung still converges
    constexpr int kRungs = 5;
    const double moves = u.cwiseQuotient(units).cwiseAbs().maxCoeff();
    if (moves == 0) return VectorXd(VectorXd::Zero(2 * (states + P)));
    const LadderDerivative slope = difference_ladder([&](double h) { return adjoints(state.y() + h * u); },
                                                     2 * (states + P), {kStep / moves, kRungs});
    if (!slope.derivative.allFinite()) throw std::runtime_error("the derivative of the mode is not finite");
    return slope.derivative;
  };
  const VectorXd by_re = along(v_in_y.real()), by_im = along(v_in_y.imag());
  const Index one = states + P;
  const VectorXd re = by_re.head(one) - by_im.tail(one), im = by_re.tail(one) + by_im.head(one);
  MatrixXd lambda_rho(P, 2), y_bar(states, 2);
  lambda_rho << re.tail(P), im.tail(P);
  y_bar << re.head(states), im.head(states);
  state.assembly.add_adjoint(y_bar, lambda_rho);

  // d|lambda| = Re(conj(lambda) dlambda)/|lambda|
  const VectorXd size_rho = (lambda.real() * lambda_rho.col(0) + lambda.imag() * lambda_rho.col(1)) / size;
  if (spec_.value.ends_with("frequency")) return {value_of(lambda), size_rho / (2 * std::numbers::pi)};
  return {value_of(lambda), -lambda_rho.col(0) / size + (lambda.real() / (size * size)) * size_rho};
}

}  // namespace mbsopt::inline optim
