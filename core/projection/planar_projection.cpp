#include "core/projection/planar_projection.hpp"

#include <algorithm>
#include <cmath>

#include "core/projection/constraint_response.hpp"

namespace mbsopt {
namespace {

Eigen::VectorXd alpha_in_plane(const MechanismData& data) {
  Eigen::VectorXd alpha(static_cast<Eigen::Index>(data.planar->rows.size()));
  data.planar->gather(data.row_alpha, alpha);
  return alpha;
}

// Frames at (r, P) moving at (rdot, w), where |P| = 1.
template <class T>
void set_frame(const Complex<T>& A, const T& w, PlanarFrame<T>& f) {
  f.A = A;
  f.Adot = times_i(w * A);
}

}  // namespace

PlanarProjector::PlanarProjector(const MechanismData& data)
    : data_(data),
      model_(*data.planar),
      bodies_in_y_(model_),
      solver_(data, kProjectionAlpha * alpha_in_plane(data)),
      rows_(data),
      constraints_(data),
      laws_(data, model_.rows) {
  const std::size_t n = at(data.n);
  const Eigen::Index m = rows_.count();
  bodies_.resize(n + 1), frames_.resize(n + 1), frames_tilde_.resize(n + 1), dual_frames_.resize(n + 1);
  for (auto* x : {&delta_, &u_, &b_, &x_, &corrections_.r, &corrections_.dx, &corrections_.Ex}) x->resize(n);
  for (Eigen::VectorXd* x : {&nu_, &kappa_, &phi_, &g_, &mu_, &corrections_.rg, &corrections_.dnu}) x->setZero(m);
  angles_.setZero(static_cast<Eigen::Index>(data.angles.size()));
  shifts_.resize(n + 1), still_.resize(n + 1), bars_.resize(n + 1), q_bar_.resize(n + 1), v_bar_.resize(n + 1);
  load_dirs_.resize(n + 1);
  auto& lanes = corrections_of_lanes_;
  for (auto* x : {&q_dir_, &v_dir_, &b_lanes_, &x_lanes_, &lanes.r, &lanes.dx, &lanes.Ex}) x->resize(n);
  for (LaneRows* x : {&dirs_.phi, &dirs_.phi_dot, &dirs_.phi_ddot, &g_lanes_, &nu_lanes_, &lanes.rg, &lanes.dnu}) {
    x->setZero(m, kLanes);
  }
}

void PlanarProjector::set_hat(const Eigen::VectorXd& y_hat) {
  for (int i = 1; i <= data_.n; ++i) {
    Body& b = bodies_[at(i)];
    const Eigen::Index q = 7 * (i - 1), v = 7 * data_.n + q;
    b.r_hat = bodies_in_y_.vector(y_hat, q);
    b.P_hat = bodies_in_y_.turn(at(i), y_hat, q + 3);
    b.P_tilde = (1 / std::sqrt(squared_norm(b.P_hat))) * b.P_hat;
    b.rdot = bodies_in_y_.vector(y_hat, v);
    b.Pdot_hat = bodies_in_y_.turn(at(i), y_hat, v + 3);
    frames_tilde_[at(i)].r = b.r_hat;
    frames_tilde_[at(i)].A = b.P_tilde * b.P_tilde;
  }
}

void PlanarProjector::set_positions() {
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    const Vec<3>& d = delta_[k - 1];
    const double half = 0.5 * d(2), norm2 = 1 + half * half;
    b.r = b.r_hat + Plane{d(0), d(1)};
    b.P = (1 / std::sqrt(norm2)) * (Plane{1, half} * b.P_tilde);
    b.turn_by_delta = 1 / norm2;
    frames_[k].r = b.r;
    frames_[k].A = b.P * b.P;
  }
}

void PlanarProjector::set_velocities() {
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    Body& b = bodies_[k];
    b.w_n = 2 * cross(b.P, b.Pdot_hat);
    b.w = b.w_n + u_[k - 1](2);
    frames_[k].rdot = b.rdot + Plane{u_[k - 1](0), u_[k - 1](1)};
    set_frame(frames_[k].A, b.w, frames_[k]);
  }
}

bool PlanarProjector::project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
                              ProjectionSolution& s) {
  laws_.set_time(t);
  set_hat(y_hat);
  if (!solver_.factor(frames_tilde_)) return false;
  const Eigen::Index half = 7 * data_.n;
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  for (Vec<3>& d : delta_) d.setZero();
  set_positions();
  const auto phi = [&](Eigen::VectorXd& out) { constraints_.phi(frames_, laws_, angles, out); };
  if (!onto_constraints(solver_, solver_.rows(), q_size, kUnmetPosition, delta_, nu_, corrections_, phi,
                        [&](const auto&) { set_positions(); }))
    return false;

  for (Vec<3>& u : u_) u.setZero();
  set_velocities();
  rows_.evaluate(frames_);
  const auto phi_dot = [&](Eigen::VectorXd& out) { constraints_.phi_dot(frames_, laws_, out); };
  if (!onto_constraints(solver_, rows_, v_size, kUnmetVelocity, u_, kappa_, corrections_, phi_dot,
                        [&](const auto&) { set_velocities(); }))
    return false;

  y = y_hat;
  bool finite = true;
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Eigen::Index q = 7 * (i - 1), v = 7 * data_.n + q;
    const Body& b = bodies_[k];
    const Plane Pdot = times_i(0.5 * b.w * b.P);
    bodies_in_y_.add_vector(b.r - b.r_hat, q, y);
    bodies_in_y_.add_turn(k, b.P - b.P_hat, q + 3, y);
    bodies_in_y_.add_vector(frames_[k].rdot - b.rdot, v, y);
    bodies_in_y_.add_turn(k, Pdot - b.Pdot_hat, v + 3, y);
    s.delta[k - 1] << delta_[k - 1], 0, 0, 0;
    s.u[k - 1] << u_[k - 1], 0, 0, 0;
    finite = finite && delta_[k - 1].allFinite() && u_[k - 1].allFinite();
  }
  model_.spread(nu_, s.nu), model_.spread(kappa_, s.kappa);
  return finite && y.allFinite();
}

void PlanarProjector::response(Eigen::VectorXd& out) {
  constraint_response(solver_, test_load<3>, kProjectionAlpha, b_, g_, corrections_.dx, corrections_.dnu, out);
}

// The bodies and frames of a given state.
void PlanarProjector::read(const Eigen::VectorXd& y) {
  for (int i = 1; i <= data_.n; ++i) {
    Body& b = bodies_[at(i)];
    PlanarFrame<double>& f = frames_[at(i)];
    const Eigen::Index q = 7 * (i - 1), v = 7 * data_.n + q;
    b.P = bodies_in_y_.turn(at(i), y, q + 3);
    b.w = 2 * cross(b.P, bodies_in_y_.turn(at(i), y, v + 3));
    f.r = b.r = bodies_in_y_.vector(y, q);
    f.rdot = bodies_in_y_.vector(y, v);
    f.set_turn(b.P, bodies_in_y_.turn(at(i), y, v + 3), 0);
  }
}

double PlanarProjector::position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y) {
  laws_.set_time(t);
  read(y);
  constraints_.phi(frames_, laws_, angles, phi_);
  double worst = rows_.count() > 0 ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (std::size_t k = 1; k < bodies_.size(); ++k) worst = std::max(worst, std::abs(squared_norm(bodies_[k].P) - 1));
  return worst;
}

double PlanarProjector::velocity_violation(double t, const Eigen::VectorXd& y) {
  laws_.set_time(t);
  read(y);
  constraints_.phi_dot(frames_, laws_, phi_);
  double worst = rows_.count() > 0 ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (int i = 1; i <= data_.n; ++i) {
    const Plane Pdot = bodies_in_y_.turn(at(i), y, 7 * (data_.n + i - 1) + 3);
    worst = std::max(worst, 2 * std::abs(dot(bodies_[at(i)].P, Pdot)));
  }
  return worst;
}

bool PlanarProjector::linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat,
                                const Eigen::VectorXd&, const ProjectionSolution& s) {
  laws_.set_time(t);
  angles_ = angles;
  set_hat(y_hat);
  if (!solver_.factor(frames_tilde_)) return false;
  for (std::size_t i = 0; i < delta_.size(); ++i) delta_[i] = s.delta[i].head<3>(), u_[i] = s.u[i].head<3>();
  model_.gather(s.nu, nu_), model_.gather(s.kappa, kappa_);
  set_positions();
  set_velocities();
  rows_.evaluate(frames_);
  return true;
}

template <class X>
void PlanarProjector::turn_by_E(std::vector<X>& x) const {
  for (std::size_t i = 0; i < x.size(); ++i) x[i].row(2) *= bodies_[i + 1].turn_by_delta;
}

void PlanarProjector::set_b(const ParameterBlock& block, const std::vector<Vec<3>>& x) {
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const BodyData& body = data_.bodies[k];
    Lanes<3>& b = b_lanes_[k - 1];
    b = -load_dirs_[k];
    Lanes<1> dm;
    if (const auto* m = block.field<1>(body.slot_mass, dm)) b.row(0) -= x[k - 1](0) * *m, b.row(1) -= x[k - 1](1) * *m;
    Lanes<6> storage;
    if (const auto* J = block.field<6>(body.slot_J, storage)) {
      b.row(2) -= x[k - 1](2) * (bodies_in_y_.inertia_weights(k).transpose() * *J);
    }
  }
}

void PlanarProjector::tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) {
  using Order = PlanarConstraints::Order;
  using Lane = LaneDual::Lane;
  const auto E = [&](std::vector<Lanes<3>>& x, bool) { turn_by_E(x); };
  const Eigen::Index half = 7 * data_.n;
  // A frame's place along the direction of (r, theta).
  const auto place = [](const Plane& r, const Plane& A, const Lanes<3>& dir, PlanarFrame<LaneDual>& f) {
    const Plane iA = times_i(A);
    f.r = {{r.re, dir.row(0).array()}, {r.im, dir.row(1).array()}};
    f.A = {{A.re, Lane(iA.re * dir.row(2).array())}, {A.im, Lane(iA.im * dir.row(2).array())}};
  };
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Body& b = bodies_[k];
    const Eigen::Index q = 7 * (i - 1);
    const PlaneDual r = bodies_in_y_.vector(b.r_hat, y_hat_dir, q), P = bodies_in_y_.turn(k, b.P_hat, y_hat_dir, q + 3);
    Lanes<3>& dir = q_dir_[k - 1];
    dir.row(0) = r.re.d.matrix(), dir.row(1) = r.im.d.matrix();
    dir.row(2) = ((2 / squared_norm(b.P_hat)) * (b.P_hat.re * P.im.d - b.P_hat.im * P.re.d)).matrix();
    place(b.r_hat, frames_tilde_[k].A, dir, dual_frames_[k]);
  }
  for (Lanes<3>& load : load_dirs_) load.setZero();
  constraints_.tangents(Order::phi, dual_frames_, laws_, angles_, block, nu_, dirs_, load_dirs_);
  set_b(block, delta_);
  // Phi' at q with delta fixed.
  for (std::size_t k = 1; k < bodies_.size(); ++k) place(bodies_[k].r, frames_[k].A, q_dir_[k - 1], dual_frames_[k]);
  constraints_.tangents(Order::phi, dual_frames_, laws_, angles_, block, nu_, dirs_, load_dirs_);
  g_lanes_ = -dirs_.phi;
  refine(solver_, rows_, ProjectionLevel::position, false, largest(q_dir_), b_lanes_, g_lanes_, x_lanes_, nu_lanes_,
         corrections_of_lanes_, E);
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    x_lanes_[k - 1].row(2) *= bodies_[k].turn_by_delta;
    q_dir_[k - 1] += x_lanes_[k - 1];
  }

  // w_n' = 2 Im(conj(P) Pdot^') - theta' Re(conj(P) Pdot^)
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Body& b = bodies_[k];
    const Eigen::Index v = half + 7 * (i - 1);
    const PlaneDual rdot = bodies_in_y_.vector(b.rdot, y_hat_dir, v),
                    Pdot = bodies_in_y_.turn(k, b.Pdot_hat, y_hat_dir, v + 3);
    Lanes<3>& dir = v_dir_[k - 1];
    dir.row(0) = rdot.re.d.matrix(), dir.row(1) = rdot.im.d.matrix();
    dir.row(2) = (2 * (b.P.re * Pdot.im.d - b.P.im * Pdot.re.d)).matrix() - dot(b.P, b.Pdot_hat) * q_dir_[k - 1].row(2);
    PlanarFrame<LaneDual>& f = dual_frames_[k];
    place(b.r, frames_[k].A, q_dir_[k - 1], f);
    f.rdot = {{frames_[k].rdot.re, rdot.re.d}, {frames_[k].rdot.im, rdot.im.d}};
    f.Adot = times_i(LaneDual{b.w, dir.row(2).array()} * f.A);
  }
  if (rows_.count() > 0) {
    for (Lanes<3>& load : load_dirs_) load.setZero();
    constraints_.tangents(Order::phi_dot, dual_frames_, laws_, angles_, block, kappa_, dirs_, load_dirs_);
    set_b(block, u_);
    g_lanes_ = -dirs_.phi_dot;
    refine(solver_, rows_, ProjectionLevel::velocity, false, largest(v_dir_), b_lanes_, g_lanes_, x_lanes_, nu_lanes_,
           corrections_of_lanes_, E);
    for (std::size_t i = 0; i < v_dir_.size(); ++i) v_dir_[i] += x_lanes_[i];
  }

  // P' = i theta'/2 P,  Pdot = i w/2 P; what leaves the plane is carried along.
  y_dir = y_hat_dir;
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Body& b = bodies_[k];
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    const Lanes<3>&dq = q_dir_[k - 1], &dv = v_dir_[k - 1];
    const Plane iP = times_i(b.P);
    const PlaneDual P{{b.P.re, Lane(0.5 * iP.re * dq.row(2).array())}, {b.P.im, Lane(0.5 * iP.im * dq.row(2).array())}};
    const PlaneDual Pdot = times_i(LaneDual{0.5 * b.w, Lane(0.5 * dv.row(2).array())} * P);
    const auto replace = [&](Eigen::Index r_row, const Lanes<3>& dir, const PlaneDual& turn) {
      const PlaneDual old = bodies_in_y_.turn(k, {}, y_hat_dir, r_row + 3);
      y_dir.row(r_row + model_.t1) = dir.row(0), y_dir.row(r_row + model_.t2) = dir.row(1);
      bodies_in_y_.add_turn_direction(k, turn - old, r_row + 3, y_dir);
    };
    replace(q, dq, P);
    replace(v, dv, Pdot);
  }
}

void PlanarProjector::add_mass_bar(const std::vector<Vec<3>>& eta, const std::vector<Vec<3>>& x,
                                   Eigen::VectorXd& theta_bar) const {
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    const BodyData& body = data_.bodies[k];
    const Vec<3>&e = eta[k - 1], &z = x[k - 1];
    if (body.slot_mass >= 0) theta_bar(body.slot_mass) -= e(0) * z(0) + e(1) * z(1);
    if (body.slot_J >= 0) theta_bar.segment<6>(body.slot_J) -= e(2) * z(2) * bodies_in_y_.inertia_weights(k);
  }
}

void PlanarProjector::add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                                  Eigen::VectorXd& rho_bar) {
  const Eigen::Index half = 7 * data_.n;
  const auto E = [&](std::vector<Vec<3>>& x, bool) { turn_by_E(x); };
  // A gradient in the turn and its rate from one in A and Adot = i w A.
  const auto theta_of = [](const PlanarFrame<double>& f, const PlanarFrameBar& bar) {
    return dot(bar.A, times_i(f.A)) + dot(bar.Adot, times_i(f.Adot));
  };
  // The image A_eta = i A eta_theta of a virtual turn, moved to A.
  const auto fold = [](const PlanarShift& eta, PlanarFrameBar& bar) { bar.A -= eta.turn * times_i(bar.A_eta); };
  const auto shift = [&](const std::vector<Vec<3>>& x) {
    for (std::size_t k = 1; k < bodies_.size(); ++k) shifts_[k] = PlanarShift(x[k - 1]);
  };

  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    const Body& b = bodies_[k];
    const Plane iP = times_i(b.P);
    const Plane P_bar = bodies_in_y_.turn(k, y_bar, q + 3), Pdot_bar = bodies_in_y_.turn(k, y_bar, v + 3);
    // P' = i theta'/2 P,  Pdot = i w/2 P
    q_bar_[k] = {bodies_in_y_.vector(y_bar, q), 0.5 * (dot(P_bar, iP) - 0.5 * b.w * dot(Pdot_bar, b.P))};
    v_bar_[k] = {bodies_in_y_.vector(y_bar, v), 0.5 * dot(Pdot_bar, iP)};
  }
  // Velocities: (eta, chi) from v_bar; then the gradient of v_bar'v - eta'(M u + J'kappa) - chi'Phidot.
  if (rows_.count() > 0) {
    for (std::size_t k = 1; k < bodies_.size(); ++k) b_[k - 1] << v_bar_[k].r.re, v_bar_[k].r.im, v_bar_[k].theta;
    g_.setZero();
    refine(solver_, rows_, ProjectionLevel::velocity, true, LargestEntries<Vec<3>>::Zero(), b_, g_, x_, mu_,
           corrections_, E);
    for (PlanarFrameBar& bar : bars_) bar = {};
    shift(x_);
    constraints_.add_pull_back(frames_, shifts_, laws_, angles_, {&kappa_, nullptr, &mu_, nullptr}, -1, bars_,
                               theta_bar, rho_bar);
    add_mass_bar(x_, u_, theta_bar);
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      fold(shifts_[k], bars_[k]);
      q_bar_[k].r += bars_[k].r;
      q_bar_[k].theta += theta_of(frames_[k], bars_[k]);
      v_bar_[k].r += bars_[k].rdot;
      v_bar_[k].theta += dot(bars_[k].Adot, times_i(frames_[k].A));
    }
  }
  // w_n = 2 Im(conj(P) Pdot^)
  for (std::size_t k = 1; k < bodies_.size(); ++k) {
    q_bar_[k].theta -= v_bar_[k].theta * dot(bodies_[k].P, bodies_[k].Pdot_hat);
  }

  // Positions: (eta, chi) from delta's cotangent; then the gradient of q_bar'q - eta'(M delta + J~'nu) - chi'Phi(q).
  if (rows_.count() > 0) {
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      b_[k - 1] << q_bar_[k].r.re, q_bar_[k].r.im, bodies_[k].turn_by_delta * q_bar_[k].theta;
    }
    g_.setZero();
    refine(solver_, rows_, ProjectionLevel::position, true, LargestEntries<Vec<3>>::Zero(), b_, g_, x_, mu_,
           corrections_, E);
    for (PlanarFrameBar& bar : bars_) bar = {};
    constraints_.add_pull_back(frames_, still_, laws_, angles_, {nullptr, &mu_, nullptr, nullptr}, -1, bars_, theta_bar,
                               rho_bar);
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      q_bar_[k].r += bars_[k].r;
      q_bar_[k].theta += dot(bars_[k].A, times_i(frames_[k].A));
      bars_[k] = {};
    }
    shift(x_);
    constraints_.add_pull_back(frames_tilde_, shifts_, laws_, angles_, {&nu_, nullptr, nullptr, nullptr}, -1, bars_,
                               theta_bar, rho_bar);
    add_mass_bar(x_, delta_, theta_bar);
    for (std::size_t k = 1; k < bodies_.size(); ++k) {
      fold(shifts_[k], bars_[k]);
      q_bar_[k].r += bars_[k].r;
      q_bar_[k].theta += dot(bars_[k].A, times_i(frames_tilde_[k].A));
    }
  }
  // Into y_hat_bar; what leaves the plane is carried along.
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Eigen::Index q = 7 * (i - 1), v = half + q;
    const Body& b = bodies_[k];
    const auto carry = [&](Eigen::Index r_row, const Plane& r_bar, const Plane& turn_bar) {
      y_hat_bar.segment<7>(r_row) += y_bar.segment<7>(r_row);
      bodies_in_y_.add_vector(r_bar - bodies_in_y_.vector(y_bar, r_row), r_row, y_hat_bar);
      bodies_in_y_.add_turn(k, turn_bar - bodies_in_y_.turn(k, y_bar, r_row + 3), r_row + 3, y_hat_bar);
    };
    carry(q, q_bar_[k].r, (2 * q_bar_[k].theta / squared_norm(b.P_hat)) * times_i(b.P_hat));
    carry(v, v_bar_[k].r, (2 * v_bar_[k].theta) * times_i(b.P));
  }
}

}  // namespace mbsopt
