#include "core/dynamics/motion_terms.hpp"

#include <algorithm>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/body/state_layout.hpp"
#include "core/dynamics/space.hpp"
#include "core/force/forces.hpp"
#include "core/linear/prefetch.hpp"

namespace mbsopt {

MotionTerms::MotionTerms(const MechanismData& data, const FormulationSettings& settings)
    : data_(data),
      two_xi_omega_(2 * settings.xi * settings.omega),
      omega2_(settings.omega * settings.omega),
      has_forces_(!(data.forces->empty() && data.applied.empty() && data.user_forces.empty())),
      forces_read_y_(!(data.applied.empty() && data.user_forces.empty())),
      laws_(data),
      constraints_(data),
      forces_(data),
      user_(data) {
  const std::size_t n = static_cast<std::size_t>(data.n);
  frames.resize(n + 1);
  body_loads_.resize(n + 1);
  load_dirs_.resize(n + 1);
  bars_.resize(n + 1);
  f.resize(n);
  z.resize(n);
  b_dir.resize(n);
  y_.setZero(StateLayout{data.n}.size());
  angles_.setZero(static_cast<Eigen::Index>(data.angles.size()));
  for (Eigen::VectorXd* x : {&lambda, &phi_, &phi_dot_}) x->setZero(data.m);
  for (LaneRows* x : {&constraint_dirs_.phi, &constraint_dirs_.phi_dot, &constraint_dirs_.phi_ddot, &c_dir}) {
    x->setZero(data.m, kLanes);
  }
}

void MotionTerms::set_time(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  t_ = t;
  if (forces_read_y_) y_ = y;
  if (!user_.masses().empty()) user_.set_masses(y);
  angles_ = angles;
  laws_.set_time(t);
  if (linear_) linear_->current = false;
}

void MotionTerms::set_body(const Eigen::VectorXd& y, std::size_t body) {
  const StateLayout layout{data_.n};
  set_position(y.segment<7>(layout.q(body)), frames[body]);
  set_velocity(y.segment<7>(layout.v(body)), frames[body]);
}

void MotionTerms::set_own_load(std::size_t body) {
  const BodyData& b = data_.bodies[body];
  const Vector3d omega = frames[body].omega();
  f[body - 1].head<3>() = b.mass * data_.gravity;
  f[body - 1].tail<3>() = -omega.cross(b.J * omega);
}

void MotionTerms::add_forces() {
  if (!has_forces_) return;
  for (Vec<6>& load : body_loads_) load.setZero();
  forces_.add_loads(here(), body_loads_);
  if (!data_.user_forces.empty()) user_.add_loads(here(), body_loads_);
  for (std::size_t i = 0; i < f.size(); ++i) f[i] += body_loads_[i + 1];
}

void MotionTerms::set_state(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  set_time(t, y, angles);
  const Vec<6> none = Vec<6>::Zero();
  for (std::size_t k = 1; k < frames.size(); ++k) {
    prefetch(&frames[k], kAhead);
    set_body(y, k);
    set_acceleration(none, frames[k]);
    set_own_load(k);
  }
  add_forces();
}

void MotionTerms::set_motion(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                             const Eigen::Ref<const Eigen::VectorXd>& a,
                             const Eigen::Ref<const Eigen::VectorXd>& multipliers) {
  const StateLayout layout{data_.n};
  set_time(t, y, angles);
  lambda = multipliers;
  for (std::size_t k = 1; k < frames.size(); ++k) {
    set_body(y, k);
    const Vector4d& p = frames[k].p;
    z[k - 1].head<3>() = a.segment<3>(layout.q(k));
    z[k - 1].tail<3>() = (2 / p.squaredNorm()) * G_times(p, a.segment<4>(layout.p(k)));
  }
  set_accelerations();
}

void MotionTerms::set_accelerations() {
  for (std::size_t k = 1; k < frames.size(); ++k) set_acceleration(z[k - 1], frames[k]);
  if (linear_) linear_->current = false;
}

void MotionTerms::set_loads() {
  for (std::size_t k = 1; k < frames.size(); ++k) set_own_load(k);
  add_forces();
}

void MotionTerms::add_stabilisation(Eigen::VectorXd& gamma) {
  if (omega2_ == 0) return;
  constraints_.phi(frames, laws_, angles_, phi_);
  constraints_.phi_dot(frames, laws_, phi_dot_);
  gamma += two_xi_omega_ * phi_dot_ + omega2_ * phi_;
}

void MotionTerms::complete_gamma(Eigen::VectorXd& phi_ddot) {
  laws_.subtract(2, phi_ddot);
  add_stabilisation(phi_ddot);
}

void MotionTerms::acceleration_errors(Eigen::VectorXd& out) {
  constraints_.phi_ddot(frames, laws_, out);
  add_stabilisation(out);
}

double MotionTerms::usual_acceleration(double enough) const {
  double largest = std::max(1e-9, data_.gravity.norm());
  for (std::size_t k = 1; k < frames.size() && !(largest >= enough); ++k) {
    const BodyData& b = data_.bodies[k];
    const Vec<6>& load = f[k - 1];
    const double omega = frames[k].omega().norm();
    largest = std::max(largest, omega * (omega + frames[k].rdot.norm()));
    if (b.mass > 0) largest = std::max(largest, load.head<3>().norm() / b.mass);
    if (b.J.trace() > 0) largest = std::max(largest, load.tail<3>().norm() / b.J.trace());
  }
  return largest;
}

const MotionBlocks& MotionTerms::blocks() {
  if (!linear_) {
    MotionBlocks empty(data_);
    ConstraintBlocks constraints(data_, empty, two_xi_omega_, omega2_);
    std::vector<bool> reads_units(frames.size(), false);
    constraints.mark_units(reads_units);
    forces_.mark_units(reads_units);
    std::vector<std::size_t> readers;
    for (std::size_t i = 1; i < reads_units.size(); ++i) {
      if (reads_units[i]) readers.push_back(i);
    }
    std::vector<UnitTangents> units(readers.empty() ? 0 : readers.back() + 1);
    linear_.emplace(
        Linearisation{std::move(empty), std::move(constraints), std::move(units), std::move(readers), false});
  }
  Linearisation& x = *linear_;
  if (x.current) return x.blocks;
  x.current = true;
  x.blocks.set_zero();
  for (const std::size_t i : x.bodies_of_units) set_unit_tangents(frames[i], x.units[i]);
  x.constraints.add(frames, x.units, lambda, x.blocks);
  forces_.add_blocks(here(), x.units, x.blocks);
  if (!data_.user_forces.empty()) user_.add_blocks(here(), z, x.blocks);
  for (int i = 1; i <= data_.n; ++i) {
    // -(omega x J omega)' = (skew(J omega) - skew(omega) J) omega',   omega' = 2 (G(p) pdot' - G(pdot) p')
    const std::size_t k = static_cast<std::size_t>(i);
    const BodyState& body = frames[k];
    const Matrix3d& J = data_.bodies[k].J;
    const Vector3d omega = body.omega();
    const Matrix3d by_omega = 2 * (skew(J * omega) - skew(omega) * J);
    MotionBlocks::Block<6>& block = x.blocks.b[static_cast<std::size_t>(x.blocks.pair(i, i))];
    block.q.block<3, 4>(3, 3) -= by_omega * G(body.pdot);
    block.v.block<3, 4>(3, 3) += by_omega * G(body.p);
    block.parts |= MotionBlocks::p | MotionBlocks::pdot;
  }
  return x.blocks;
}

void MotionTerms::set_tangents(const ParameterBlock& block, const LaneRows& y_dir) {
  for (Lanes<6>& load : load_dirs_) load.setZero();
  constraints_.tangents(frames, nullptr, laws_, angles_, block, lambda, constraint_dirs_, load_dirs_);
  for (Lanes<6>& load : load_dirs_) load = -load;  // from (J'lambda)' to its share of b'
  forces_.add_field_tangent(here(), block, load_dirs_);
  if (!data_.user_forces.empty()) user_.add_field_tangent(here(), z, block, load_dirs_);

  Lanes<3> gravity_dir;
  const Lanes<3>* dg = block.field<3>(data_.slot_gravity, gravity_dir);
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const BodyData& body = data_.bodies[k];
    Lanes<6>& b = b_dir[k - 1];
    b = load_dirs_[k];
    Vec<6> x = z[k - 1];
    x.head<3>() -= data_.gravity;
    InSpace::subtract_mass_tangent(data_, k, block, x, b);
    if (dg) b.topRows<3>() += body.mass * *dg;
    Lanes<6> J_dir;
    if (const Lanes<6>* dJ = block.field<6>(body.slot_J, J_dir)) {
      const Vector3d omega = frames[k].omega();
      b.bottomRows<3>() -= cross(omega, inertia_tangent_times(*dJ, omega));
    }
  }
  c_dir = -constraint_dirs_.phi_ddot;
  if (omega2_ != 0) c_dir -= two_xi_omega_ * constraint_dirs_.phi_dot + omega2_ * constraint_dirs_.phi;
  blocks().add_times(y_dir, b_dir, c_dir);
}

void MotionTerms::add_pull_back(const std::vector<Vec<6>>& eta, const Eigen::VectorXd& mu,
                                const std::vector<Vector4d>& pddot_bar, Eigen::Ref<Eigen::VectorXd> y_bar,
                                Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  const StateLayout layout{data_.n};
  for (FrameBar& bar : bars_) bar.set_zero();
  for (std::size_t k = 1; k < frames.size(); ++k) set_virtual(eta[k - 1], frames[k]);
  // - eta'J'lambda - mu'(Phiddot + 2 xi omega Phidot + omega^2 Phi)
  ConstraintWeights weights{&lambda, nullptr, nullptr, &mu};
  if (omega2_ != 0) {
    phi_dot_ = two_xi_omega_ * mu;
    phi_ = omega2_ * mu;
    weights.mu0 = &phi_;
    weights.mu1 = &phi_dot_;
  }
  constraints_.add_pull_back(frames, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  forces_.add_pull_back(here(), bars_, y_bar, theta_bar, rho_bar);
  if (!data_.user_forces.empty()) user_.add_pull_back(here(), z, eta, y_bar, rho_bar);

  for (std::size_t k = 1; k < frames.size(); ++k) {
    const BodyData& body = data_.bodies[k];
    const BodyState& state = frames[k];
    const Vector3d eta_r = eta[k - 1].head<3>(), eta_w = eta[k - 1].tail<3>();
    mbsopt::add_pull_back(state, bars_[k], pddot_bar[k], eta_w, y_bar.segment<7>(layout.q(k)),
                          y_bar.segment<7>(layout.v(k)));
    // - eta_w'(omega x J omega):  d/domega = -(J omega x eta_w + J (eta_w x omega))
    const Vector3d omega = state.omega(), J_omega = body.J * omega;
    const Vector3d omega_bar = -(J_omega.cross(eta_w) + body.J * eta_w.cross(omega));
    y_bar.segment<4>(layout.pdot(k)) += 2 * G_transposed_times(state.p, omega_bar);
    y_bar.segment<4>(layout.p(k)) -= 2 * G_transposed_times(state.pdot, omega_bar);
    if (body.slot_mass >= 0) theta_bar(body.slot_mass) += eta_r.dot(data_.gravity - z[k - 1].head<3>());
    if (data_.slot_gravity >= 0) theta_bar.segment<3>(data_.slot_gravity) += body.mass * eta_r;
    if (body.slot_J >= 0) {
      // - eta_w'J omegadot - (eta_w x omega)'J omega
      const Matrix3d X = -(eta_w * z[k - 1].tail<3>().transpose() + eta_w.cross(omega) * omega.transpose());
      theta_bar.segment<6>(body.slot_J) += inertia_gradient(X);
    }
  }
}

}  // namespace mbsopt
