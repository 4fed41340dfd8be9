#include "core/dynamics/dynamics.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/dynamics/space.hpp"
#include "core/linear/prefetch.hpp"
#include "core/mechanism/joint_graph.hpp"

namespace mbsopt {
namespace {

// alpha of S for the quasi-definite solution, which is the same whatever it is: large against any inertia, so that few
// refinements do (a row between light bodies may have to move heavy ones behind them), and not so large that S loses
// the smallest. Either that of the penalty itself, or far from it: in between refinements would crawl where rows are
// redundant.
double moderate_alpha(const MechanismData& data, double penalty) {
  if (data.m == 0) return penalty;
  double least = data.row_alpha.minCoeff(), most = data.row_alpha.maxCoeff();
  for (const BodyData& b : data.bodies) {
    most = std::max({most, b.mass, b.J.trace()});
    if (b.mass > 0) least = std::min(least, b.mass);
    if (b.J.trace() > 0) least = std::min(least, b.J.trace());
  }
  const double moderate = std::clamp(1e11 * least, 1e3 * most, 1e7 * most);
  return penalty <= moderate ? penalty : std::min(moderate, penalty / 100);
}

// Along a chain of L joints the least eigenvalue of J inv(M) J' falls as 1/L^2, and with it what a pass gains. From ten
// times alpha on rounding takes a third pass, which chains of hundreds of joints in space need anyway; chains in the
// plane do not (docs/formulations.md).
double alpha_along_chains(const MechanismData& data) {
  constexpr double kLong = 316;
  const double L = joints_to_farthest_body(data);
  if (data.planar || L < kLong) return std::clamp(L * L / 10, 1.0, 10.0);
  return std::clamp(L * L / 1000, 10.0, 1000.0);
}

FormulationSettings of_mechanism(const MechanismData& data, FormulationSettings settings) {
  if (settings.type == FormulationType::augmented_lagrangian) settings.alpha *= alpha_along_chains(data);
  return settings;
}

Eigen::VectorXd alpha_of_factor(const MechanismData& data, const FormulationSettings& settings) {
  if (settings.type == FormulationType::augmented_lagrangian) return settings.alpha * data.row_alpha;
  const bool moderate = settings.linear_solver == LinearSolver::quasidefinite;
  return Eigen::VectorXd::Constant(data.m, moderate ? moderate_alpha(data, settings.alpha) : settings.alpha);
}

bool any_force(const MechanismData& d) { return !(d.forces.empty() && d.applied.empty() && d.user_forces.empty()); }

constexpr double kDerivativeTolerance = 1e-12;

double compliance_of(const FormulationSettings& settings) {
  return settings.type == FormulationType::penalty ? 1 / settings.alpha : 0.0;
}

}  // namespace

Dynamics::Dynamics(const Mechanism& mechanism, const FormulationSettings& settings, Model model)
    : mechanism_(mechanism),
      data_(mechanism_.data()),
      settings_(of_mechanism(data_, settings)),
      laws_(data_),
      constraints_(data_),
      forces_(data_),
      solver_(data_, alpha_of_factor(data_, settings_), compliance_of(settings)),
      has_forces_(any_force(data_)),
      forces_read_y_(!(data_.applied.empty() && data_.user_forces.empty())) {
  const std::size_t n = static_cast<std::size_t>(data_.n);
  const Eigen::Index m = data_.m, P = data_.rho.size();
  if (!has_forces_ && std::any_of(data_.bodies.begin() + 1, data_.bodies.end(), [](auto& b) { return b.mass > 0; })) {
    const bool planar = model == Model::planar;
    free_fall_ = planar ? std::sqrt(squared_norm(data_.planar->gravity)) : data_.gravity.norm();
  }
  if (model == Model::planar) {
    planar_ = std::make_unique<PlanarDynamics>(data_, settings_, solver_.alpha(), compliance_of(settings),
                                               solver_settings(false), solver_settings(true));
    return;
  }
  y_.setZero(14 * data_.n);
  angles_.setZero(static_cast<Eigen::Index>(data_.angles.size()));
  bodies_.resize(n + 1);
  frames_.resize(n + 1);
  loads_.resize(n), z_.resize(n), eta_.resize(n), body_loads_.resize(n + 1);
  for (Eigen::VectorXd* x : {&gamma_, &phi_, &phi_dot_, &lambda_, &mu_, &g_}) x->setZero(m);
  load_dirs_.resize(n + 1), rhs_lanes_.resize(n), z_dir_.resize(n);
  for (LaneRows* x :
       {&constraint_dirs_.phi, &constraint_dirs_.phi_dot, &constraint_dirs_.phi_ddot, &gamma_dir_, &lambda_dir_}) {
    x->setZero(m, kLanes);
  }
  bars_.resize(n + 1);
  pddot_bar_.resize(n + 1);
  a_.setZero(7 * data_.n);
  Eigen::Index largest = 0;
  for (const UserForceData& f : data_.user_forces) {
    largest = std::max(largest, 7 * static_cast<Eigen::Index>(f.bodies.size()));
  }
  for (Eigen::VectorXd* x : {&user_q_, &user_v_, &user_Q_, &user_e_}) x->setZero(largest);
  user_K_.setZero(largest, largest), user_C_.setZero(largest, largest), user_Q_rho_.setZero(largest, P);
}

// Derivatives are those of the limit: at least as many refinements as bring alpha^-(passes) to rounding, and until J x'
// is right to 1e-12: what is missing, M^-1 J' times an error of nu', is what the projection's derivative takes out.
// All: as many as bring what S loses of M to alpha to rounding.
SaddleSolver::Settings Dynamics::solver_settings(bool derivative) const {
  if (settings_.type == FormulationType::penalty) {
    if (settings_.linear_solver == LinearSolver::cholesky) return {};
    return {2, 50, 1e-15};
  }
  const double digits = std::max(1.0, std::log10(settings_.alpha));
  const int rounding = std::clamp(static_cast<int>(std::ceil(14 / std::max(1.0, 16 - digits))) - 1, 1, 14);
  if (!derivative) return {std::min(rounding, settings_.iterations), settings_.iterations, settings_.tolerance};
  const int least = std::max(rounding, std::clamp(static_cast<int>(std::ceil(15 / digits)) - 1, 1, 8));
  return {least, std::max(least, settings_.iterations), kDerivativeTolerance};
}

double Dynamics::compliance() const { return compliance_of(settings_); }

void Dynamics::set_time_and_angles(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  t_ = t;
  if (forces_read_y_) y_ = y;
  angles_ = angles;
  laws_.set_time(t);
  if (linear_) linear_->current = false;
}

void Dynamics::set_body(const Eigen::VectorXd& y, int body) {
  const std::size_t k = static_cast<std::size_t>(body);
  set_position(y.segment<7>(7 * (body - 1)), bodies_[k], frames_[k]);
  set_velocity(y.segment<7>(7 * (data_.n + body - 1)), bodies_[k], frames_[k]);
}

void Dynamics::set_own_load(int body) {
  const std::size_t k = static_cast<std::size_t>(body);
  const BodyData& b = data_.bodies[k];
  const Vector3d omega = bodies_[k].omega();
  loads_[k - 1].head<3>() = b.mass * data_.gravity;
  loads_[k - 1].tail<3>() = -omega.cross(b.J * omega);
}

void Dynamics::add_forces() {
  if (!has_forces_) return;
  for (Vec<6>& load : body_loads_) load.setZero();
  forces_.add_loads(here(), body_loads_);
  if (!data_.user_forces.empty()) add_user_loads();
  for (std::size_t i = 0; i < loads_.size(); ++i) loads_[i] += body_loads_[i + 1];
}

// The scale of accelerations: loads on each body alone, and turning.
double Dynamics::usual_acceleration() const {
  double largest = 1e-9;
  for (std::size_t i = 0; i < loads_.size(); ++i) {
    const BodyData& b = data_.bodies[i + 1];
    const double omega = bodies_[i + 1].omega().norm();
    largest = std::max(largest, omega * (omega + frames_[i + 1].rdot.norm()));
    if (b.mass > 0) largest = std::max(largest, loads_[i].head<3>().norm() / b.mass);
    if (b.J.trace() > 0) largest = std::max(largest, loads_[i].tail<3>().norm() / b.J.trace());
  }
  return largest;
}

// The share of a body's turning in usual_acceleration().
double Dynamics::turning_acceleration(const Eigen::VectorXd& y, int body) const {
  const Eigen::Index v = 7 * (data_.n + body - 1);
  const double omega = 2 * y.segment<4>(v + 3).norm();
  return omega * (omega + y.segment<3>(v).norm());
}

double Dynamics::least_usual_acceleration(const Eigen::VectorXd& y) const {
  return std::max(free_fall_, data_.n > 0 ? turning_acceleration(y, fastest_) : 0.0);
}

// Where nothing accelerates (a wheel driven at constant speed) what is left is rounding. The sweep over all bodies is
// left out where one of them says that the residual is no larger than those before; which one, is looked for ever more
// rarely, for loads may be more than any turning.
template <class Usual>
void Dynamics::note_residual(double ratio, double size, const Eigen::VectorXd& y, Usual&& usual_acceleration) {
  constexpr double kRounding = 1e-9;
  if (settings_.type != FormulationType::augmented_lagrangian || !(ratio > worst_residual_)) return;
  if (size <= (1 + kRounding) * worst_residual_ * least_usual_acceleration(y)) return;
  worst_residual_ = std::max(worst_residual_, std::min(ratio, size / usual_acceleration()));
  if (!std::has_single_bit(++sweeps_)) return;
  double largest = 0;
  for (int i = 1; i <= data_.n; ++i) {
    const double turning = turning_acceleration(y, i);
    if (turning > largest) largest = turning, fastest_ = i;
  }
}

bool Dynamics::evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                        Eigen::Ref<Eigen::VectorXd> ydot) {
  if (planar_) {
    const bool finite = planar_->evaluate(t, y, angles, ydot);
    note_residual(planar_->residual_ratio(), planar_->residual_size(), y,
                  [&] { return planar_->usual_acceleration(); });
    return finite;
  }
  set_time_and_angles(t, y, angles);
  const Vec<6> none = Vec<6>::Zero();
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    prefetch(&frames_[k], kAhead);
    set_body(y, i);
    set_acceleration(none, bodies_[k], frames_[k]);
    set_own_load(i);
  }
  add_forces();
  if (!solver_.factor(frames_, &gamma_)) return false;
  laws_.subtract_f_tt(gamma_);
  if (settings_.omega != 0) {
    constraints_.phi(frames_, laws_, angles_, phi_);
    constraints_.phi_dot(frames_, laws_, phi_dot_);
    gamma_ += 2 * settings_.xi * settings_.omega * phi_dot_ + settings_.omega * settings_.omega * phi_;
  }
  g_ = -gamma_;
  solver_.solve(loads_, g_, solver_settings(false), z_, lambda_);
  note_residual(solver_.residual_ratio(), solver_.residual_size(), y, [&] { return usual_acceleration(); });

  const Eigen::Index half = 7 * data_.n;
  ydot.head(half) = y.tail(half);
  bool finite = true;
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    bodies_[k].omegadot = z_[k - 1].tail<3>();
    ydot.segment<3>(half + 7 * (i - 1)) = z_[k - 1].head<3>();
    ydot.segment<4>(half + 7 * (i - 1) + 3) = bodies_[k].pddot();
    finite = finite && z_[k - 1].allFinite();
  }
  return finite;
}

bool Dynamics::linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                         const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  ++linearised_states_;
  if (planar_) return planar_->linearise(t, y, angles, a, lambda);
  set_motion(t, y, angles, a, lambda);
  return solver_.factor(frames_);
}

void Dynamics::linearise_here() {
  assert(!planar_);
  for (std::size_t i = 1; i < frames_.size(); ++i) set_acceleration(z_[i - 1], bodies_[i], frames_[i]);
  if (linear_) linear_->current = false;
}

void Dynamics::tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& ydot_dir) {
  const Eigen::Index half = 7 * data_.n;
  ydot_dir.topRows(half) = y_dir.bottomRows(half);
  acceleration_tangent(block, y_dir, ydot_dir.bottomRows(half));
}

void Dynamics::acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir, Eigen::Ref<LaneRows> a_dir) {
  if (planar_) return planar_->acceleration_tangent(block, y_dir, a_dir);
  const int n = data_.n;
  right_hand_side_tangent(block, y_dir);
  solver_.solve(rhs_lanes_, gamma_dir_, solver_settings(true), z_dir_, lambda_dir_);

  const Eigen::Index half = 7 * n;
  for (int i = 1; i <= n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const Vector4d& p = bodies_[k].p;
    const Lanes<3> w = z_dir_[k - 1].bottomRows<3>();
    a_dir.middleRows<3>(7 * (i - 1)) = z_dir_[k - 1].topRows<3>();
    // pddot' = (pddot' with omegadot fixed) + 1/2 G(p)' omegadot'
    auto out = a_dir.middleRows<4>(7 * (i - 1) + 3);
    out = pddot_tangent(bodies_[k], y_dir.middleRows<4>(7 * (i - 1) + 3), y_dir.middleRows<4>(half + 7 * (i - 1) + 3));
    out.row(0) -= 0.5 * dot(p.tail<3>(), w);
    out.bottomRows<3>() += 0.5 * (p(0) * w + cross(p.tail<3>(), w));
  }
}

void Dynamics::add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                           Eigen::VectorXd& rho_bar, const Motion* motion) {
  assert(!(planar_ && motion));
  if (planar_) return planar_->add_adjoint(w, y_bar, theta_bar, rho_bar);
  const Eigen::Index half = 7 * data_.n;
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    loads_[k - 1] = to_virtual(bodies_[k], w.segment<7>(half + 7 * (i - 1)));
    if (motion) loads_[k - 1] += motion->z[k - 1];
  }
  g_.setZero();
  if (motion) g_ = motion->lambda;
  solver_.solve(loads_, g_, solver_settings(true), eta_, mu_);
  y_bar.tail(half) += w.head(half);
  for (int i = 1; i <= data_.n; ++i) {
    pddot_bar_[static_cast<std::size_t>(i)] = w.segment<4>(half + 7 * (i - 1) + 3);
  }
  pull_back(y_bar, theta_bar, rho_bar);
}

void Dynamics::pull_back(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  const int n = data_.n;
  const Eigen::Index half = 7 * n;
  for (FrameBar& bar : bars_) bar.set_zero();
  for (std::size_t k = 1; k < frames_.size(); ++k) set_virtual(eta_[k - 1], frames_[k]);
  // - eta'J'lambda - mu'(Phiddot + 2 xi omega Phidot + omega^2 Phi)
  ConstraintWeights weights{&lambda_, nullptr, nullptr, &mu_};
  if (settings_.omega != 0) {
    phi_dot_ = 2 * settings_.xi * settings_.omega * mu_;
    phi_ = settings_.omega * settings_.omega * mu_;
    weights.mu0 = &phi_, weights.mu1 = &phi_dot_;
  }
  constraints_.add_pull_back(frames_, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  forces_.add_pull_back(here(), bars_, y_bar, theta_bar, rho_bar);
  if (!data_.user_forces.empty()) add_user_adjoint(y_bar, rho_bar);

  for (int i = 1; i <= n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const BodyData& body = data_.bodies[k];
    const BodyState& state = bodies_[k];
    const Vector3d eta_r = eta_[k - 1].head<3>(), eta_w = eta_[k - 1].tail<3>();
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    add_pull_back(state, bars_[k], pddot_bar_[k], eta_w, y_bar.segment<7>(q), y_bar.segment<7>(v));
    // - eta_w'(omega x J omega):  d/domega = -(J omega x eta_w + J (eta_w x omega))
    const Vector3d omega = state.omega(), J_omega = body.J * omega;
    const Vector3d omega_bar = -(J_omega.cross(eta_w) + body.J * eta_w.cross(omega));
    y_bar.segment<4>(v + 3) += 2 * G_transposed_times(state.p, omega_bar);
    y_bar.segment<4>(q + 3) -= 2 * G_transposed_times(state.pdot, omega_bar);
    if (body.slot_mass >= 0) theta_bar(body.slot_mass) += eta_r.dot(data_.gravity - z_[k - 1].head<3>());
    if (data_.slot_gravity >= 0) theta_bar.segment<3>(data_.slot_gravity) += body.mass * eta_r;
    if (body.slot_J >= 0) {
      // - eta_w'J omegadot - (eta_w x omega)'J omega
      const Matrix3d X = -(eta_w * z_[k - 1].tail<3>().transpose() + eta_w.cross(omega) * omega.transpose());
      theta_bar.segment<6>(body.slot_J) += inertia_gradient(X);
    }
  }
}

}  // namespace mbsopt
