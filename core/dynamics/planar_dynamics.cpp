#include "core/dynamics/planar_dynamics.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/dynamics/pairs.hpp"

namespace mbsopt {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

bool any_force_but_springs(const MechanismData& d) {
  return !(d.rsda.empty() && d.applied.empty() && d.bushings.empty() && d.turning_frictions.empty() &&
           d.sliding_frictions.empty());
}

Eigen::VectorXd in_plane(const PlanarModel& model, const Eigen::VectorXd& of_rows) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(model.rows.size()));
  model.gather(of_rows, out);
  return out;
}

std::vector<std::size_t> bodies_with_inertial_slots(const MechanismData& data) {
  std::vector<std::size_t> bodies;
  for (std::size_t k = 1; k < data.bodies.size(); ++k) {
    if (data.bodies[k].slot_mass >= 0 || data.bodies[k].slot_J >= 0) bodies.push_back(k);
  }
  return bodies;
}

// The blocks of forces alone.
MotionBlocks force_blocks(MechanismData data) {
  data.constraints.clear();
  data.m = 0;
  return MotionBlocks(data);
}

}  // namespace

PlanarDynamics::PlanarDynamics(const MechanismData& data, const FormulationSettings& settings,
                               const Eigen::VectorXd& alpha, double compliance, const Refinements& values,
                               const Refinements& derivatives)
    : data_(data),
      model_(*data.planar),
      bodies_in_y_(model_),
      settings_(settings),
      value_refinements_(values),
      derivative_refinements_(derivatives),
      laws_(data, model_.rows),
      constraints_(data),
      bodies_with_slots_(bodies_with_inertial_slots(data)),
      solver_(data, in_plane(model_, alpha), compliance),
      springs_(data),
      has_springs_(!data.tsda.empty()),
      has_other_forces_(any_force_but_springs(data)),
      forces_(data) {
  const std::size_t n = at(data.n);
  y_.setZero(14 * data.n);
  angles_.setZero(static_cast<Eigen::Index>(data.angles.size()));
  bodies_.resize(n + 1), frames_.resize(n + 1), dual_frames_.resize(n + 1);
  loads_.resize(n), z_.resize(n), eta_.resize(n);
  const Eigen::Index m = static_cast<Eigen::Index>(model_.rows.size());
  for (Eigen::VectorXd* x : {&gamma_, &phi_, &phi_dot_, &lambda_, &mu_, &g_}) x->setZero(m);
  lambda_of_phi_.setZero(data.m);
  for (LaneRows* x :
       {&constraint_dirs_.phi, &constraint_dirs_.phi_dot, &constraint_dirs_.phi_ddot, &gamma_dir_, &lambda_dir_}) {
    x->setZero(m, kLanes);
  }
  load_dirs_.resize(n + 1), rhs_lanes_.resize(n), z_dir_.resize(n);
  turns_.resize(n + 1), turn_dirs_.resize(n + 1), Addot_dirs_.resize(n + 1), moments_.resize(n + 1);
  shifts_.resize(n + 1), bars_.resize(n + 1);
  std::vector<bool> dual(n + 1, settings.omega != 0);
  constraints_.mark_others(dual);
  for (std::size_t i = 1; i <= n; ++i) {
    if (dual[i]) dual_bodies_.push_back(i);
  }
  if (!has_springs_ && !has_other_forces_) return;
  std::vector<bool> loaded(n + 1, false);
  forces_.mark_units(loaded);
  for (std::size_t i = 1; i <= n; ++i) {
    if (loaded[i]) loaded_.push_back(i);
  }
  states_in_space_.resize(n + 1), frames_in_space_.resize(n + 1), body_loads_.resize(n + 1);
  body_load_dirs_.resize(n + 1), bars_in_space_.resize(n + 1);
}

void PlanarDynamics::set_state(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles) {
  t_ = t;
  tangents_ready_ = false;
  laws_.set_time(t);
  const Eigen::Index half = 7 * data_.n;
  for (int i = 1; i <= data_.n; ++i) {
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    Body& b = bodies_[at(i)];
    PlanarFrame<double>& f = frames_[at(i)];
    f.r = bodies_in_y_.vector(y, q), f.rdot = bodies_in_y_.vector(y, v), f.rddot = {};
    b.P = bodies_in_y_.turn(at(i), y, q + 3), b.Pdot = bodies_in_y_.turn(at(i), y, v + 3);
    f.set_turn(b.P, b.Pdot, 0);
  }
  angles_ = angles;
  if (!has_springs_ && !has_other_forces_) return;
  y_ = y;
  in_space_ = false;
  springs_in_plane_ = has_springs_ && springs_.lie_in_plane(y);
  if (has_other_forces_ || !springs_in_plane_) place_in_space();
}

void PlanarDynamics::place_in_space() {
  in_space_ = true;
  for (const std::size_t k : loaded_) {
    const Eigen::Index q = 7 * (static_cast<Eigen::Index>(k) - 1);
    set_position(y_.segment<7>(q), states_in_space_[k], frames_in_space_[k]);
    set_velocity(y_.segment<7>(7 * data_.n + q), states_in_space_[k], frames_in_space_[k]);
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
  if (!in_space_) return;
  body_loads_[0].setZero();
  for (const std::size_t k : loaded_) body_loads_[k].setZero();
  if (springs_in_plane_) {
    forces_.add_loads_but_springs(here(), body_loads_);
  } else {
    forces_.add_loads(here(), body_loads_);
  }
  for (const std::size_t k : loaded_) loads_[k - 1] += bodies_in_y_.reduced(k, body_loads_[k]);
}

bool PlanarDynamics::evaluate(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                              Eigen::Ref<Eigen::VectorXd> ydot) {
  set_state(t, y, angles);
  set_loads();
  constraints_.phi_ddot(frames_, laws_, gamma_);
  if (settings_.omega != 0) {
    constraints_.phi(frames_, laws_, angles_, phi_);
    constraints_.phi_dot(frames_, laws_, phi_dot_);
    gamma_ += 2 * settings_.xi * settings_.omega * phi_dot_ + settings_.omega * settings_.omega * phi_;
  }
  if (!solver_.factor(frames_)) return false;
  g_ = -gamma_;
  solver_.solve(loads_, g_, value_refinements_, z_, lambda_);
  model_.spread(lambda_, lambda_of_phi_);

  const Eigen::Index half = 7 * data_.n;
  ydot.head(half) = y.tail(half);
  ydot.tail(half).setZero();
  bool finite = true;
  for (int i = 1; i <= data_.n; ++i) {
    const Vec<3>& z = z_[at(i - 1)];
    Body& b = bodies_[at(i)];
    const Eigen::Index a = half + 7 * (i - 1);
    b.omegadot = z(2);
    bodies_in_y_.add_vector({z(0), z(1)}, a, ydot);
    bodies_in_y_.add_turn(at(i), Plane{-squared_norm(b.Pdot), 0.5 * z(2)} * b.P, a + 3, ydot);
    finite = finite && z.allFinite();
  }
  return finite;
}

double PlanarDynamics::usual_acceleration() const {
  double largest = 1e-9;
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
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
  for (int i = 1; i <= data_.n; ++i) {
    const Eigen::Index q = 7 * (i - 1);
    const Plane& P = bodies_[at(i)].P;
    const Plane rddot = bodies_in_y_.vector(a, q), Pddot = bodies_in_y_.turn(at(i), a, q + 3);
    z_[at(i - 1)] << rddot.re, rddot.im, 2 * cross(P, Pddot) / squared_norm(P);
    set_acceleration(at(i), z_[at(i - 1)]);
  }
  return solver_.factor(frames_);
}

// With P' and Pdot' for directions, products of complex numbers and real dot products:
//   Addot' = 4 Pdot Pdot' + (i omegadot - 2 |Pdot|^2) 2 P P' - 4 (Pdot'Pdot') A
//   Pddot' = (i omegadot/2 - |Pdot|^2) P' - 2 (Pdot'Pdot') P        and with omegadot':  + i omegadot'/2 P
void PlanarDynamics::prepare_tangents() {
  tangents_ready_ = true;
  constraints_.set_point_moments(lambda_, moments_);
  const auto product = [](const Plane& g, auto&& block) { block << g.re, -g.im, g.im, g.re; };
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const Body& b = bodies_[k];
    const Plane &A = frames_[k].A, &P = b.P, &Pdot = b.Pdot;
    const double size = squared_norm(Pdot);
    TurnTangent& x = turns_[k];
    x.moment = conj(2 * P) * moments_[k];
    product(2 * (Plane{-2 * size, b.omegadot} * P), x.Addot.leftCols<2>());
    product(4 * Pdot, x.Addot.rightCols<2>());
    product(Plane{-size, 0.5 * b.omegadot}, x.Pddot.leftCols<2>());
    const Eigen::RowVector2d along(Pdot.re, Pdot.im);
    x.Addot.row(0).tail<2>() -= 4 * A.re * along, x.Addot.row(1).tail<2>() -= 4 * A.im * along;
    x.Pddot.row(0).tail<2>() = -2 * P.re * along, x.Pddot.row(1).tail<2>() = -2 * P.im * along;
  }
  if (!loaded_.empty()) prepare_force_tangents();
}

// The blocks of forces, as the plane sees them.
void PlanarDynamics::prepare_force_tangents() {
  if (!force_linearisation_) {
    force_linearisation_.emplace(
        ForceLinearisation{force_blocks(data_), std::vector<UnitTangents>(bodies_.size()), {}});
    force_linearisation_->in_plane.resize(force_linearisation_->blocks.b.size());
  }
  if (!in_space_) place_in_space();
  ForceLinearisation& x = *force_linearisation_;
  x.blocks.set_zero();
  for (const std::size_t k : loaded_) set_unit_tangents(states_in_space_[k], x.units[k]);
  forces_.add_blocks(here(), x.units, x.blocks);
  for (std::size_t k = 0; k < x.in_plane.size(); ++k) {
    const MotionBlocks::Block<6>& block = x.blocks.b[k];
    if (block.parts == 0) continue;
    const MotionBlocks::Place& place = x.blocks.pairs()[k];
    const PlanarBody &loaded = model_.bodies[at(place.row + 1)], &read = model_.bodies[at(place.body + 1)];
    const auto in_plane = [&](const Mat<6, 7>& of) {
      Mat<3, 7> rows;
      rows << of.row(model_.t1), of.row(model_.t2), loaded.n.transpose() * of.bottomRows<3>();
      return rows;
    };
    const auto reduce = [&](const Mat<3, 7>& rows) {
      Mat<3, 4> to;
      to << rows.col(model_.t1), rows.col(model_.t2), rows.rightCols<4>() * read.p_a, rows.rightCols<4>() * read.p_b;
      return to;
    };
    const Mat<3, 7> q = in_plane(block.q);
    x.in_plane[k] = {reduce(q), reduce(in_plane(block.v)), q.col(model_.n)};
  }
}

// What forces add to b: in the state by their blocks, and in the fields.
void PlanarDynamics::add_force_tangent(const ParameterBlock& block, const LaneRows& y_dir) {
  const ForceLinearisation& x = *force_linearisation_;
  const LaneRow* y = entries(y_dir);
  for (std::size_t k = 0; k < x.in_plane.size(); ++k) {
    if (x.blocks.b[k].parts == 0) continue;
    const MotionBlocks::Place& place = x.blocks.pairs()[k];
    const LaneRow* r = y + 7 * place.body;
    const LaneRow* rdot = r + 7 * data_.n;
    const LaneRow* P = entries(turn_dirs_[at(place.body + 1)]);
    LaneRow* b = entries(rhs_lanes_[at(place.row)]);
    const Mat<3, 4>&q = x.in_plane[k].q, &v = x.in_plane[k].v;
    const Vec<3>& height = x.in_plane[k].height;
    for (int i = 0; i < 3; ++i) {
      b[i] += q(i, 0) * r[model_.t1] + q(i, 1) * r[model_.t2] + q(i, 2) * P[0] + q(i, 3) * P[1] +
              v(i, 0) * rdot[model_.t1] + v(i, 1) * rdot[model_.t2] + v(i, 2) * P[2] + v(i, 3) * P[3] +
              height(i) * r[model_.n];
    }
  }
  for (const std::size_t k : loaded_) body_load_dirs_[k].setZero();
  body_load_dirs_[0].setZero();
  forces_.add_field_tangent(here(), block, body_load_dirs_);
  for (const std::size_t k : loaded_) rhs_lanes_[k - 1] += bodies_in_y_.reduced(k, body_load_dirs_[k]);
}

// Of constraints that are no points, and of laws: duals.
void PlanarDynamics::add_other_tangents(const ParameterBlock& block, const LaneRows& y_dir) {
  using Order = PlanarConstraints::Order;
  const Eigen::Index half = 7 * data_.n;
  for (const std::size_t k : dual_bodies_) {
    const Eigen::Index q = 7 * (static_cast<Eigen::Index>(k) - 1), v = half + q;
    const Body& b = bodies_[k];
    PlanarFrame<LaneDual>& f = dual_frames_[k];
    f.r = bodies_in_y_.vector(frames_[k].r, y_dir, q);
    f.rdot = bodies_in_y_.vector(frames_[k].rdot, y_dir, v);
    f.rddot = frames_[k].rddot;
    const auto turn = [&](const Plane& value, Eigen::Index row) {
      return PlaneDual{{value.re, turn_dirs_[k].row(row).array()}, {value.im, turn_dirs_[k].row(row + 1).array()}};
    };
    f.set_turn(turn(b.P, 0), turn(b.Pdot, 2), b.omegadot);
  }
  const auto add = [&](Order order, double factor, const LaneRows& rows, std::vector<Lanes<3>>& loads) {
    for (Lanes<3>& load : loads) load.setZero();
    constraints_.tangents(order, dual_frames_, laws_, angles_, block, lambda_, constraint_dirs_, loads);
    gamma_dir_ -= factor * rows;
  };
  if (settings_.omega != 0) {
    add(Order::phi, settings_.omega * settings_.omega, constraint_dirs_.phi, load_dirs_);
    add(Order::phi_dot, 2 * settings_.xi * settings_.omega, constraint_dirs_.phi_dot, load_dirs_);
  }
  add(Order::phi_ddot, 1, constraint_dirs_.phi_ddot, load_dirs_);
  for (std::size_t i = 0; i < rhs_lanes_.size(); ++i) rhs_lanes_[i] -= load_dirs_[i + 1];
}

void PlanarDynamics::acceleration_tangent(const ParameterBlock& block, const LaneRows& y_dir,
                                          Eigen::Ref<LaneRows> a_dir) {
  if (!tangents_ready_) prepare_tangents();
  const Eigen::Index half = 7 * data_.n;
  const LaneRow* y = entries(y_dir);
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const PlanarBody& body = model_.bodies[k];
    const LaneRow* p = y + 7 * (k - 1) + 3;
    LaneRow* P = entries(turn_dirs_[k]);
    for (int i = 0; i < 4; i += 2, p += half) {
      P[i] = body.p_a(0) * p[0] + body.p_a(1) * p[1] + body.p_a(2) * p[2] + body.p_a(3) * p[3];
      P[i + 1] = body.p_b(0) * p[0] + body.p_b(1) * p[1] + body.p_b(2) * p[2] + body.p_b(3) * p[3];
    }
    const TurnTangent& x = turns_[k];
    LaneRow* Addot = entries(Addot_dirs_[k]);
    for (int i = 0; i < 2; ++i) {
      Addot[i] = x.Addot(i, 0) * P[0] + x.Addot(i, 1) * P[1] + x.Addot(i, 2) * P[2] + x.Addot(i, 3) * P[3];
    }
    LaneRow* b = entries(rhs_lanes_[k - 1]);
    b[0] = LaneRow{}, b[1] = LaneRow{};
    b[2] = x.moment.re * P[1] - x.moment.im * P[0];
  }
  gamma_dir_.setZero();
  if (!dual_bodies_.empty() || !data_.laws.empty()) add_other_tangents(block, y_dir);
  constraints_.subtract_point_tangents(frames_, Addot_dirs_, block, lambda_, gamma_dir_, rhs_lanes_);

  Lanes<3> gravity_dir;
  const Lanes<3>* dg = block.field<3>(data_.slot_gravity, gravity_dir);
  for (std::size_t i = 0; dg && i < rhs_lanes_.size(); ++i) {
    const double mass = model_.bodies[i + 1].mass;
    rhs_lanes_[i].row(0) += mass * dg->row(model_.t1), rhs_lanes_[i].row(1) += mass * dg->row(model_.t2);
  }
  for (const std::size_t k : bodies_with_slots_) {
    const BodyData& body = data_.bodies[k];
    const Vec<3>& z = z_[k - 1];
    Lanes<3>& b = rhs_lanes_[k - 1];
    Lanes<1> mass_dir;
    if (const Lanes<1>* dm = block.field<1>(body.slot_mass, mass_dir)) {
      b.row(0) += (model_.gravity.re - z(0)) * *dm, b.row(1) += (model_.gravity.im - z(1)) * *dm;
    }
    Lanes<6> J_dir;
    if (const Lanes<6>* dJ = block.field<6>(body.slot_J, J_dir)) {
      b.row(2) -= z(2) * (bodies_in_y_.inertia_weights(k).transpose() * *dJ);
    }
  }
  if (!loaded_.empty()) add_force_tangent(block, y_dir);
  solver_.solve(rhs_lanes_, gamma_dir_, derivative_refinements_, z_dir_, lambda_dir_);

  LaneRow* out = reinterpret_cast<LaneRow*>(a_dir.data());
  for (std::size_t k = 1; k < bodies_.size(); ++k, out += 7) {
    const PlanarBody& body = model_.bodies[k];
    const TurnTangent& x = turns_[k];
    const Plane& turn = bodies_[k].P;
    const LaneRow *P = entries(turn_dirs_[k]), *z = entries(z_dir_[k - 1]);
    for (int i = 0; i < 3; ++i) out[i] = LaneRow{};
    out[model_.t1] = z[0], out[model_.t2] = z[1];
    LaneRow Pddot[2];
    for (int i = 0; i < 2; ++i) {
      Pddot[i] = x.Pddot(i, 0) * P[0] + x.Pddot(i, 1) * P[1] + x.Pddot(i, 2) * P[2] + x.Pddot(i, 3) * P[3];
    }
    Pddot[0] -= (0.5 * turn.im) * z[2], Pddot[1] += (0.5 * turn.re) * z[2];
    for (int i = 0; i < 4; ++i) out[3 + i] = body.p_a(i) * Pddot[0] + body.p_b(i) * Pddot[1];
  }
}

void PlanarDynamics::add_adjoint(const Eigen::VectorXd& w, Eigen::Ref<Eigen::VectorXd> y_bar,
                                 Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  const Eigen::Index half = 7 * data_.n;
  for (int i = 1; i <= data_.n; ++i) {
    const Eigen::Index a = half + 7 * (i - 1);
    const Plane rddot_bar = bodies_in_y_.vector(w, a), Pddot_bar = bodies_in_y_.turn(at(i), w, a + 3);
    loads_[at(i - 1)] << rddot_bar.re, rddot_bar.im, 0.5 * cross(bodies_[at(i)].P, Pddot_bar);
  }
  g_.setZero();
  solver_.solve(loads_, g_, derivative_refinements_, eta_, mu_);
  y_bar.tail(half) += w.head(half);

  for (PlanarFrameBar& bar : bars_) bar = {};
  for (std::size_t k = 1; k < bodies_.size(); ++k) shifts_[k] = PlanarShift(eta_[k - 1]);
  // - eta'J'lambda - mu'(Phiddot + 2 xi omega Phidot + omega^2 Phi)
  PlanarConstraints::Weights weights{&lambda_, nullptr, nullptr, &mu_};
  if (settings_.omega != 0) {
    phi_dot_ = 2 * settings_.xi * settings_.omega * mu_;
    phi_ = settings_.omega * settings_.omega * mu_;
    weights.mu0 = &phi_, weights.mu1 = &phi_dot_;
  }
  constraints_.add_pull_back(frames_, shifts_, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  if (springs_in_plane_) {
    springs_.add_pull_back(t_, frames_, shifts_, forces_.law_scratch(), bars_, theta_bar, rho_bar);
  }
  if (has_other_forces_ || (has_springs_ && !springs_in_plane_)) add_force_adjoint(y_bar, theta_bar, rho_bar);

  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Body& b = bodies_[k];
    const PlanarFrame<double>& f = frames_[k];
    const BodyData& body = data_.bodies[k];
    const Vec<3>&eta = eta_[k - 1], &z = z_[k - 1];
    const PlanarFrameBar& bar = bars_[k];
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    const Plane Pddot_bar = bodies_in_y_.turn(k, w, v + 3);
    // A_eta = i eta_theta A and the frame's turn (PlanarFrame::set_turn), then Pddot.
    const Plane A_bar =
        bar.A - eta(2) * times_i(bar.A_eta) + conj(Plane{-2 * squared_norm(b.Pdot), b.omegadot}) * bar.Addot;
    const Plane P_bar = 2 * (conj(b.P) * A_bar + conj(b.Pdot) * bar.Adot) +
                        conj(Plane{-squared_norm(b.Pdot), 0.5 * b.omegadot}) * Pddot_bar;
    const Plane Pdot_bar = 2 * (conj(b.P) * bar.Adot) + 4 * (conj(b.Pdot) * bar.Addot) -
                           (4 * dot(f.A, bar.Addot) + 2 * dot(b.P, Pddot_bar)) * b.Pdot;
    bodies_in_y_.add_vector(bar.r, q, y_bar);
    bodies_in_y_.add_vector(bar.rdot, v, y_bar);
    bodies_in_y_.add_turn(k, P_bar, q + 3, y_bar);
    bodies_in_y_.add_turn(k, Pdot_bar, v + 3, y_bar);
    if (body.slot_mass >= 0) {
      theta_bar(body.slot_mass) += eta(0) * (model_.gravity.re - z(0)) + eta(1) * (model_.gravity.im - z(1));
    }
    if (data_.slot_gravity >= 0) {
      theta_bar.segment<3>(data_.slot_gravity) += body.mass * model_.in_space({eta(0), eta(1)});
    }
    if (body.slot_J >= 0) theta_bar.segment<6>(body.slot_J) -= eta(2) * z(2) * bodies_in_y_.inertia_weights(k);
  }
}

void PlanarDynamics::add_force_adjoint(Eigen::Ref<Eigen::VectorXd> y_bar, Eigen::VectorXd& theta_bar,
                                       Eigen::VectorXd& rho_bar) {
  bars_in_space_[0].set_zero();
  for (const std::size_t k : loaded_) {
    bars_in_space_[k].set_zero();
    set_virtual(bodies_in_y_.in_space(k, eta_[k - 1]), frames_in_space_[k]);
  }
  if (springs_in_plane_) {
    forces_.add_pull_back_but_springs(here(), bars_in_space_, y_bar, theta_bar, rho_bar);
  } else {
    forces_.add_pull_back(here(), bars_in_space_, y_bar, theta_bar, rho_bar);
  }
  const Eigen::Index half = 7 * data_.n;
  for (const std::size_t k : loaded_) {
    const Eigen::Index q = 7 * (static_cast<Eigen::Index>(k) - 1);
    add_pull_back(states_in_space_[k], bars_in_space_[k], Vector4d::Zero(), eta_[k - 1](2) * model_.bodies[k].n,
                  y_bar.segment<7>(q), y_bar.segment<7>(half + q));
  }
}

}  // namespace mbsopt
