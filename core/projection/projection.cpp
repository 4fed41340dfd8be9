#include "core/projection/projection.hpp"

#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/constraint/unit_norm.hpp"
#include "core/dynamics/planar_bodies.hpp"
#include "core/projection/constraint_response.hpp"

namespace mbsopt {

Projector::Projector(const Mechanism& mechanism, Projection what, Model model)
    : mechanism_(mechanism),
      data_(mechanism_.data()),
      what_(what),
      planar_(model == Model::planar ? std::make_unique<PlanarProjector>(data_) : nullptr),
      solver_(data_, kProjectionAlpha * data_.row_alpha),
      rows_(data_),
      laws_(data_) {
  const std::size_t n = at(data_.n);
  const Eigen::Index m = data_.m;
  bodies_.resize(n + 1);
  states_.resize(n + 1), states_tilde_.resize(n + 1), frames_.resize(n + 1), frames_tilde_.resize(n + 1);
  for (Eigen::VectorXd* x : {&phi_, &g_, &mu_, &corrections_.rg, &corrections_.dnu}) x->setZero(m);
  angles_.setZero(static_cast<Eigen::Index>(data_.angles.size()));
  scratch_y_.setZero(14 * data_.n);
  q_bar_.setZero(7 * data_.n), v_bar_.setZero(7 * data_.n);
  for (auto* x : {&b_, &x_, &corrections_.r, &corrections_.dx, &corrections_.Ex}) x->resize(n);
  bars_.resize(n + 1);
  frame_dirs_.resize(n + 1);
  for (FrameTangent& t : frame_dirs_) t.set_zero();
  loads_.resize(n + 1);
  auto& lanes = corrections_of_lanes_;
  for (auto* x : {&b_lanes_, &x_lanes_, &lanes.r, &lanes.dx, &lanes.Ex}) x->resize(n);
  for (LaneRows* x : {&dirs_.phi, &dirs_.phi_dot, &dirs_.phi_ddot, &g_lanes_, &nu_lanes_, &lanes.rg, &lanes.dnu}) {
    x->setZero(m, kLanes);
  }
}

ProjectionSolution Projector::solution() const {
  ProjectionSolution s;
  const std::size_t n = active() ? at(data_.n) : 0;
  s.delta.assign(n, Vec<6>::Zero());
  s.u.assign(n, Vec<6>::Zero());
  s.nu.setZero(active() ? data_.m : 0);
  s.kappa.setZero(active() ? data_.m : 0);
  return s;
}

void Projector::set_frames(const Eigen::VectorXd& q_of, const Eigen::VectorXd* v_of, std::vector<BodyState>& states,
                           std::vector<Frame>& frames) const {
  for (int i = 1; i <= data_.n; ++i) {
    set_position(q_of.segment<7>(7 * (i - 1)), states[at(i)], frames[at(i)]);
    if (v_of) set_velocity(v_of->segment<7>(7 * (data_.n + i - 1)), states[at(i)], frames[at(i)]);
  }
}

void Projector::prepare_bodies(const Eigen::VectorXd& y_hat) {
  for (int i = 1; i <= data_.n; ++i) {
    Body& b = bodies_[at(i)];
    b.p_hat = y_hat.segment<4>(7 * (i - 1) + 3);
    b.pdot_hat = y_hat.segment<4>(7 * (data_.n + i - 1) + 3);
    b.norm_hat = positions() ? b.p_hat.norm() : 1.0;
    b.p_tilde = b.p_hat / b.norm_hat;
    scratch_y_.segment<3>(7 * (i - 1)) = y_hat.segment<3>(7 * (i - 1));
    scratch_y_.segment<4>(7 * (i - 1) + 3) = b.p_tilde;
  }
}

// The position part of y for a correction delta of q~.
void Projector::set_q(const std::vector<Vec<6>>& delta, Eigen::VectorXd& y) {
  for (int i = 1; i <= data_.n; ++i) {
    Body& b = bodies_[at(i)];
    const Vec<6>& d = delta[at(i - 1)];
    b.pi = b.p_tilde + 0.5 * G_transposed_times(b.p_tilde, d.tail<3>());
    b.norm_pi = positions() ? b.pi.norm() : 1.0;
    b.p = b.pi / b.norm_pi;
    y.segment<3>(7 * (i - 1)) = scratch_y_.segment<3>(7 * (i - 1)) + d.head<3>();
    y.segment<4>(7 * (i - 1) + 3) = b.p;
  }
}

bool Projector::project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
                        ProjectionSolution& s) {
  if (planar_) return planar_->project(t, angles, y_hat, y, s);
  laws_.set_time(t);
  prepare_bodies(y_hat);
  set_frames(scratch_y_, nullptr, states_tilde_, frames_tilde_);
  if (!solver_.factor(frames_tilde_)) return false;

  const Eigen::Index half = 7 * data_.n;
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  const auto place = [&](const auto&) {
    set_q(s.delta, y);
    set_frames(y, nullptr, states_, frames_);
  };
  for (Vec<6>& d : s.delta) d.setZero();
  s.nu.setZero();
  place(s.delta);
  const auto phi = [&](Eigen::VectorXd& out) { evaluate_phi(data_, frames_, laws_, angles, out); };
  if (positions() &&
      !onto_constraints(solver_, solver_.rows(), q_size, kUnmetPosition, s.delta, s.nu, corrections_, phi, place))
    return false;

  for (int i = 1; i <= data_.n; ++i) {
    const Body& b = bodies_[at(i)];
    y.segment<3>(half + 7 * (i - 1)) = y_hat.segment<3>(half + 7 * (i - 1));
    y.segment<4>(half + 7 * (i - 1) + 3) = b.pdot_hat - b.p * (b.p.dot(b.pdot_hat) / b.p.squaredNorm());
  }
  rows_.evaluate(frames_);
  set_frames(y, &y, states_, frames_);
  const auto phi_dot = [&](Eigen::VectorXd& out) { evaluate_phi_dot(data_, frames_, laws_, out); };
  const auto move = [&](const std::vector<Vec<6>>& du) {
    for (int i = 1; i <= data_.n; ++i) {
      y.segment<3>(half + 7 * (i - 1)) += du[at(i - 1)].head<3>();
      y.segment<4>(half + 7 * (i - 1) + 3) += 0.5 * G_transposed_times(bodies_[at(i)].p, du[at(i - 1)].tail<3>());
    }
    set_frames(y, &y, states_, frames_);
  };
  return onto_constraints(solver_, rows_, v_size, kUnmetVelocity, s.u, s.kappa, corrections_, phi_dot, move) &&
         y.allFinite();
}

void Projector::response(Eigen::VectorXd& out) {
  if (planar_) return planar_->response(out);
  // In the plane where there is one, so that both models take the same steps.
  const auto load = [&](int i) {
    return data_.planar ? PlanarBodies(*data_.planar).in_space(at(i), test_load<3>(i)) : test_load<6>(i);
  };
  constraint_response(solver_, load, kProjectionAlpha, b_, g_, corrections_.dx, corrections_.dnu, out);
}

double Projector::position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y) {
  if (planar_) return planar_->position_violation(t, angles, y);
  laws_.set_time(t);
  set_frames(y, nullptr, states_, frames_);
  evaluate_phi(data_, frames_, laws_, angles, phi_);
  double worst = data_.m > 0 ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (int i = 1; i <= data_.n; ++i) worst = std::max(worst, std::abs(UnitNorm::phi(states_[at(i)].p)));
  return worst;
}

double Projector::velocity_violation(double t, const Eigen::VectorXd& y) {
  if (planar_) return planar_->velocity_violation(t, y);
  laws_.set_time(t);
  set_frames(y, &y, states_, frames_);
  evaluate_phi_dot(data_, frames_, laws_, phi_);
  double worst = data_.m > 0 ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (int i = 1; i <= data_.n; ++i) {
    worst = std::max(worst, std::abs(UnitNorm::phi_dot(states_[at(i)].p, states_[at(i)].pdot)));
  }
  return worst;
}

}  // namespace mbsopt
