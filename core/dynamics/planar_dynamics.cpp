#include "core/dynamics/planar_dynamics.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/dynamics/space.hpp"
#include "core/force/forces.hpp"
#include "core/mechanism/coupling.hpp"

namespace mbsopt {
namespace {

bool any_force_but_springs(const MechanismData& d) {
  return d.forces->size() > d.forces->of<TsdaForce>().size() || !d.applied.empty() || !d.user_forces.empty();
}

// Returns whether springs, torques about hinges and free torques are the only forces that depend on the state.
bool nothing_but_springs_and_torques(const MechanismData& d) {
  const std::size_t torques = d.forces->of<RsdaForce>().size() + d.forces->of<TurningFriction>().size();
  return d.forces->size() == d.forces->of<TsdaForce>().size() + torques && d.user_forces.empty() &&
         std::ranges::all_of(
             d.applied, [](const AppliedForce& f) { return !depends_on_state(f) || ForceTerms::is_free_torque(f); });
}

std::vector<std::size_t> bodies_with_inertial_slots(const MechanismData& data) {
  std::vector<std::size_t> bodies;
  for (std::size_t k = 1; k < data.bodies.size(); ++k) {
    if (data.bodies[k].slot_mass >= 0 || data.bodies[k].slot_J >= 0) bodies.push_back(k);
  }
  return bodies;
}

}  // namespace

PlanarDynamics::PlanarDynamics(const MechanismData& data, const FormulationSettings& formulation)
    : data_(data),
      model_(*data.planar),
      bodies_in_y_(model_),
      formulation_(formulation),
      settings_(saddle_settings(data, formulation)),
      laws_(InPlane::laws(data)),
      constraints_(data),
      bodies_with_slots_(bodies_with_inertial_slots(data)),
      solver_(data, rows_of<InPlane>(data, settings_.alpha), settings_.compliance),
      springs_(data),
      torques_(data),
      only_torques_(torques_.lie_in_plane() && nothing_but_springs_and_torques(data)),
      has_springs_(!data.forces->of<TsdaForce>().empty()),
      has_other_forces_(any_force_but_springs(data)),
      forces_(data),
      user_(data) {
  const std::size_t n = at(data.n);
  y_.setZero(StateLayout{data.n}.size());
  angles_.setZero(static_cast<Eigen::Index>(data.angles.size()));
  bodies_.resize(n + 1);
  frames_.resize(n + 1);
  dual_frames_.resize(n + 1);
  loads_.resize(n);
  z_.resize(n);
  eta_.resize(n);
  const Eigen::Index m = InPlane::rows(data);
  for (Eigen::VectorXd* x : {&gamma_, &phi_, &phi_dot_, &lambda_, &mu_, &g_}) x->setZero(m);
  lambda_of_phi_.setZero(data.m);
  for (LaneRows* x :
       {&constraint_dirs_.phi, &constraint_dirs_.phi_dot, &constraint_dirs_.phi_ddot, &gamma_dir_, &lambda_dir_}) {
    x->setZero(m, kLanes);
  }
  load_dirs_.resize(n + 1);
  rhs_lanes_.resize(n);
  z_dir_.resize(n);
  turns_.resize(n + 1);
  turn_dirs_.resize(n + 1);
  Addot_dirs_.resize(n + 1);
  moments_.resize(n + 1);
  bars_.resize(n + 1);
  std::vector<bool> dual(n + 1, formulation.omega != 0);
  constraints_.mark_others(dual);
  for (std::size_t i = 1; i <= n; ++i) {
    if (dual[i]) dual_bodies_.push_back(i);
  }
  if (!has_springs_ && !has_other_forces_) return;
  std::vector<bool> loaded(n + 1, false);
  forces_.mark_units(loaded);
  for (const UserForceData& f : data.user_forces) {
    for (const int body : f.bodies) loaded[at(body)] = true;
  }
  eta_in_space_.assign(n, Vec<6>::Zero());
  for (std::size_t i = 1; i <= n; ++i) {
    if (loaded[i]) loaded_.push_back(i);
  }
  frames_in_space_.resize(n + 1);
  body_loads_.resize(n + 1);
  body_load_dirs_.resize(n + 1);
  bars_in_space_.resize(n + 1);
}

void PlanarDynamics::set_state(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  t_ = t;
  tangents_ready_ = false;
  laws_.set_time(t);
  const StateLayout layout{data_.n};
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    PlanarFrame<double>& f = frames_[k];
    f.r = bodies_in_y_.vector(y, layout.q(k));
    f.rdot = bodies_in_y_.vector(y, layout.v(k));
    f.rddot = {};
    b.P = bodies_in_y_.turn(k, y, layout.p(k));
    b.Pdot = bodies_in_y_.turn(k, y, layout.pdot(k));
    f.set_turn(b.P, b.Pdot, 0);
  }
  angles_ = angles;
  if (!has_springs_ && !has_other_forces_) return;
  y_ = y;
  in_space_ = false;
  springs_in_plane_ = has_springs_ && springs_.lie_in_plane(y);
  if ((has_other_forces_ && !torques_.are_all()) || (has_springs_ && !springs_in_plane_)) place_in_space();
}

void PlanarDynamics::place_in_space() {
  in_space_ = true;
  const StateLayout layout{data_.n};
  for (const std::size_t k : loaded_) {
    set_position(y_.segment<7>(layout.q(k)), frames_in_space_[k]);
    set_velocity(y_.segment<7>(layout.v(k)), frames_in_space_[k]);
  }
}

void PlanarDynamics::set_acceleration(std::size_t body, const Vec<3>& z) {
  bodies_[body].omegadot = z(2);
  frames_[body].rddot = {z(0), z(1)};
  frames_[body].Addot += times_i(z(2) * frames_[body].A);  // from zero
}

void PlanarDynamics::set_loads() {
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const PlanarBody& b = model_.bodies[k];
    loads_[k - 1] << b.mass * model_.gravity.re, b.mass * model_.gravity.im, 0;
  }
  if (springs_in_plane_) springs_.add_loads(t_, frames_, forces_.law_scratch(), loads_);
  if (!in_space_) return torques_.add_loads(here(), frames_, forces_, loads_);
  body_loads_[0].setZero();
  for (const std::size_t k : loaded_) body_loads_[k].setZero();
  forces_.add_loads(here(), body_loads_, springs_in_plane_);
  user_.add_loads(here(), body_loads_);
  for (const std::size_t k : loaded_) loads_[k - 1] += bodies_in_y_.reduced(k, body_loads_[k]);
}

bool PlanarDynamics::evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                              Eigen::Ref<Eigen::VectorXd> ydot) {
  set_state(t, y, angles);
  set_loads();
  constraints_.phi_ddot(frames_, laws_, gamma_);
  if (formulation_.omega != 0) {
    constraints_.phi(frames_, laws_, angles_, phi_);
    constraints_.phi_dot(frames_, laws_, phi_dot_);
    gamma_ += 2 * formulation_.xi * formulation_.omega * phi_dot_ + formulation_.omega * formulation_.omega * phi_;
  }
  if (!solver_.factor(frames_)) return false;
  g_ = -gamma_;
  solver_.solve(loads_, g_, settings_.values, z_, lambda_);
  model_.spread(lambda_, lambda_of_phi_);

  const StateLayout layout{data_.n};
  ydot.head(layout.positions()) = y.tail(layout.positions());
  ydot.tail(layout.positions()).setZero();
  bool finite = true;
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Vec<3>& z = z_[k - 1];
    Body& b = bodies_[k];
    b.omegadot = z(2);
    bodies_in_y_.add_vector({z(0), z(1)}, layout.v(k), ydot);
    bodies_in_y_.add_turn(k, Plane{-squared_norm(b.Pdot), 0.5 * z(2)} * b.P, layout.pdot(k), ydot);
    finite = finite && z.allFinite();
  }
  return finite;
}

double PlanarDynamics::usual_acceleration(double enough) const {
  double largest = std::max(1e-9, std::sqrt(squared_norm(model_.gravity)));
  for (std::size_t k = 1; k < bodies_.size() && !(largest >= enough); ++k) {
    const PlanarBody& b = model_.bodies[k];
    const Vec<3>& load = loads_[k - 1];
    const double omega = 2 * std::sqrt(squared_norm(bodies_[k].Pdot));
    largest = std::max(largest, omega * (omega + std::sqrt(squared_norm(frames_[k].rdot))));
    if (b.mass > 0) largest = std::max(largest, load.head<2>().norm() / b.mass);
    if (b.inertia > 0) largest = std::max(largest, std::abs(load(2)) / b.inertia);
  }
  return largest;
}

bool PlanarDynamics::linearise(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                               const Eigen::Ref<const Eigen::VectorXd>& a,
                               const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  set_state(t, y, angles);
  model_.gather(lambda, lambda_);
  const StateLayout layout{data_.n};
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Plane& P = bodies_[k].P;
    const Plane rddot = bodies_in_y_.vector(a, layout.q(k)), Pddot = bodies_in_y_.turn(k, a, layout.p(k));
    z_[k - 1] << rddot.re, rddot.im, 2 * cross(P, Pddot) / squared_norm(P);
    set_acceleration(k, z_[k - 1]);
  }
  return solver_.factor(frames_);
}

void PlanarDynamics::linearise_here() {
  for (std::size_t k = 1; k < bodies_.size(); ++k) set_acceleration(k, z_[k - 1]);
}

void PlanarDynamics::write_motion(Motion& out) const {
  for (std::size_t k = 1; k < bodies_.size(); ++k) out.z[k - 1] = bodies_in_y_.in_space(k, z_[k - 1]);
  out.lambda = lambda_of_phi_;
}

void PlanarDynamics::add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar,
                                 Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar, const Motion* motion) {
  const StateLayout layout{data_.n};
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Plane rddot_bar = bodies_in_y_.vector(w, layout.v(k)), Pddot_bar = bodies_in_y_.turn(k, w, layout.pdot(k));
    loads_[k - 1] << rddot_bar.re, rddot_bar.im, 0.5 * cross(bodies_[k].P, Pddot_bar);
    if (motion) loads_[k - 1] += bodies_in_y_.reduced(k, motion->z[k - 1]);
  }
  g_.setZero();
  if (motion) model_.gather(motion->lambda, g_);
  solver_.solve(loads_, g_, settings_.derivatives, eta_, mu_);
  y_bar.tail(layout.positions()) += w.head(layout.positions());

  for (PlanarFrameBar& bar : bars_) bar = {};
  for (std::size_t k = 1; k < bodies_.size(); ++k) set_virtual(eta_[k - 1], frames_[k]);
  // - eta'J'lambda - mu'(Phiddot + 2 xi omega Phidot + omega^2 Phi)
  ConstraintWeights weights{&lambda_, nullptr, nullptr, &mu_};
  if (formulation_.omega != 0) {
    phi_dot_ = 2 * formulation_.xi * formulation_.omega * mu_;
    phi_ = formulation_.omega * formulation_.omega * mu_;
    weights.mu0 = &phi_;
    weights.mu1 = &phi_dot_;
  }
  constraints_.add_pull_back(frames_, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  if (springs_in_plane_) {
    springs_.add_pull_back(t_, frames_, forces_.law_scratch(), bars_, theta_bar, rho_bar);
  }
  if (has_other_forces_ || (has_springs_ && !springs_in_plane_)) add_force_adjoint(y_bar, theta_bar, rho_bar);

  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    const PlanarFrame<double>& f = frames_[k];
    const BodyData& body = data_.bodies[k];
    const Vec<3>& eta = eta_[k - 1];
    const PlanarFrameBar& bar = bars_[k];
    const Plane Pddot_bar = bodies_in_y_.turn(k, w, layout.pdot(k));
    // A_eta = i eta_theta A and the frame's turn (PlanarFrame::set_turn), then Pddot.
    const Plane A_bar =
        bar.A - eta(2) * times_i(bar.A_eta) + conj(Plane{-2 * squared_norm(b.Pdot), b.omegadot}) * bar.Addot;
    const Plane P_bar = 2 * (conj(b.P) * A_bar + conj(b.Pdot) * bar.Adot) +
                        conj(Plane{-squared_norm(b.Pdot), 0.5 * b.omegadot}) * Pddot_bar;
    const Plane Pdot_bar = 2 * (conj(b.P) * bar.Adot) + 4 * (conj(b.Pdot) * bar.Addot) -
                           (4 * dot(f.A, bar.Addot) + 2 * dot(b.P, Pddot_bar)) * b.Pdot;
    bodies_in_y_.add_vector(bar.r, layout.q(k), y_bar);
    bodies_in_y_.add_vector(bar.rdot, layout.v(k), y_bar);
    bodies_in_y_.add_turn(k, P_bar, layout.p(k), y_bar);
    bodies_in_y_.add_turn(k, Pdot_bar, layout.pdot(k), y_bar);
    InPlane::subtract_mass_bar(data_, k, eta, z_against_gravity(k), theta_bar);
    if (data_.slot_gravity >= 0) {
      theta_bar.segment<3>(data_.slot_gravity) += body.mass * model_.in_space({eta(0), eta(1)});
    }
  }
}

void PlanarDynamics::add_force_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                                       Eigen::VectorXd& rho_bar) {
  if (!in_space_) place_in_space();
  bars_in_space_[0].set_zero();
  for (const std::size_t k : loaded_) {
    bars_in_space_[k].set_zero();
    eta_in_space_[k - 1] = bodies_in_y_.in_space(k, eta_[k - 1]);
    set_virtual(eta_in_space_[k - 1], frames_in_space_[k]);
  }
  user_.add_pull_back(here(), no_mass_terms_, eta_in_space_, y_bar, rho_bar);
  forces_.add_pull_back(here(), bars_in_space_, y_bar, theta_bar, rho_bar, springs_in_plane_);
  const StateLayout layout{data_.n};
  for (const std::size_t k : loaded_) {
    add_pull_back(frames_in_space_[k], bars_in_space_[k], Vector4d::Zero(), eta_[k - 1](2) * model_.bodies[k].n,
                  y_bar.segment<7>(layout.q(k)), y_bar.segment<7>(layout.v(k)));
  }
}

}  // namespace mbsopt
