// If drives leave no freedom, J is square. Newton's method by its dense factor then finds the state, without the
// accelerations of project(). If the constraints cannot hold, the sum of their squares gives the nearest state.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/body/state_layout.hpp"
#include "core/projection/projector_of.hpp"

namespace mbsopt {

template <class Body>
bool ProjectorOf<Body>::factor_square() {
  rows_.evaluate(frames_);
  rows_.write_dense(J_);
  ++square_factorisations_;
  return J_factor_.compute(J_);
}
template <class Body>
void ProjectorOf<Body>::solve_square(const Y& rows, std::vector<X>& x) {
  Eigen::Map<Y> all(x[0].data(), N * static_cast<Eigen::Index>(x.size()));
  all = rows;
  J_factor_.solve(all);
}

template <class Body>
void ProjectorOf<Body>::displace(const Y& x) {
  for_bodies([&](Body& b, std::size_t i, auto& f) { b.displace(x.segment<N>(N * static_cast<Eigen::Index>(i)), f); });
}
// Shortens a step in which a body turns too far.
template <class Body>
void ProjectorOf<Body>::limit_turns(Y& step) {
  constexpr double kLongest = 0.5;                 // turn in one step [rad]
  constexpr Eigen::Index kTurns = N == 3 ? 1 : 3;  // the last unknowns of a body
  double turn = 0;
  for (Eigen::Index i = N - kTurns; i < step.size(); i += N)
    turn = std::max(turn, step.segment<kTurns>(i).cwiseAbs().maxCoeff());
  if (turn > kLongest) step *= kLongest / turn;
}

// Uses Newton's method; a turn of each body by dx adds to delta to first order.
template <class Body>
bool ProjectorOf<Body>::settle(double t, const Y& angles, const Y& y_hat, Y& y) {
  if (!square_) return project(t, angles, y_hat, y, settled_);
  read_hat(t, y_hat);
  const Eigen::Index half = StateLayout{data_.n}.positions();
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  std::vector<X>& dx = corrections_.dx;
  // Calls step() until |phi| is rounding. Returns false if |phi| stops falling before.
  const auto iterate = [&](double size, double unmet, auto&& evaluate, auto&& step) {
    double before = INFINITY;
    for (int k = 0; k < kMostProjectionIterations; ++k) {
      evaluate();
      const double now = phi_.cwiseAbs().maxCoeff();
      if (now < kProjectionRounding * size) return true;  // a further step would find rounding
      if (!(now < 0.5 * before)) return now <= unmet * size;
      before = now;
      if (!step()) return false;
    }
    return false;
  };
  const auto displace = [&] { for_bodies([&](Body& b, std::size_t i, auto& f) { b.displace(delta_[i], f); }); };
  for (X& d : delta_) d.setZero();
  displace();
  bool factored = false;
  const bool closed = iterate(
      q_size, kUnmetPosition, [&] { constraints_.phi(frames_, laws_, angles, phi_); },
      [&] {
        factored = factor_square();
        if (!factored) return false;
        solve_square(phi_, dx);
        for (std::size_t i = 0; i < dx.size(); ++i) delta_[i] -= dx[i];
        displace();
        return true;
      });
  if (!closed || (!factored && !factor_square())) return false;
  for_bodies([](Body& b, std::size_t, auto& f) { b.start_velocity(f); });
  for (X& u : u_) u.setZero();
  const bool moves = iterate(
      v_size, kUnmetVelocity, [&] { constraints_.phi_dot(frames_, laws_, phi_); },
      [&] {
        solve_square(phi_, dx);
        for (std::size_t i = 0; i < dx.size(); ++i) {
          dx[i] = -dx[i];
          u_[i] += dx[i];
        }
        for_bodies([&](Body& b, std::size_t i, auto& f) { b.add_velocity(u_[i], dx[i], f); });
        return true;
      });
  if (!moves) return false;
  y = y_hat;
  for_bodies([&](Body& b, std::size_t, auto& f) { b.write(f, y); });
  return y.allFinite();
}

template <class Body>
void ProjectorOf<Body>::response_of_square(Y& out) {
  out.resize(phi_.size());
  for (std::size_t i = 0; i < delta_.size(); ++i)
    out.template segment<N>(N * static_cast<Eigen::Index>(i)) = test_load_of(static_cast<int>(i) + 1);
  J_factor_.solve_transposed(out);
  J_factor_.solve(out);
  J_factor_.solve_transposed(out);
}

// Small steps follow the flow qdot = -J^-1 Phi, along which Phi falls as exp(-s) and det J cannot change its sign.
template <class Body>
bool ProjectorOf<Body>::assemble(double t, const Y& angles, const Y& y_hat, Y& y) {
  constexpr int kMost = 100;
  constexpr double kShortest = 1e-3;  // part of a step: det J vanishes on the way, or |Phi| has a least value
  if (!square_) return false;
  double sign = 0;
  // |Phi| at the state moved, and J_ there. It is infinite if det J differs in sign from that at the guess.
  const auto violation_at = [&](const Y& moved) {
    displace(moved);
    constraints_.phi(frames_, laws_, angles, phi_);
    rows_.evaluate(frames_);
    rows_.write_dense(J_);
    const double determinant = J_.determinant();
    if (sign == 0) sign = determinant;
    return determinant * sign > 0 ? phi_.norm() : INFINITY;
  };
  Y reached = y_hat;
  read_hat(t, reached);
  double violation = violation_at(Y::Zero(N * data_.n));
  const Eigen::Index half = StateLayout{data_.n}.positions();
  const double size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff());
  for (int k = 0; k < kMost && violation > kUnmetPosition * size; ++k) {
    ++square_factorisations_;
    if (!std::isfinite(violation) || !J_factor_.compute(J_)) return false;
    Y step = -phi_;
    J_factor_.solve(step);
    limit_turns(step);
    double part = 1, now = violation_at(step);
    while (!(now < violation)) {
      if ((part /= 2) < kShortest) return false;
      now = violation_at(part * step);
    }
    violation = now;
    for_bodies([&](Body& b, std::size_t, auto& f) { b.start_velocity(f), b.write(f, reached); });
    read_hat(t, reached);
  }
  reached.tail(half) = y_hat.tail(half);
  return settle(t, angles, reached, y);
}

// Levenberg-Marquardt with a damping of the size of |Phi|: it converges quadratically if the constraints can hold
// (Yamashita and Fukushima, Computing Supplementum 15 (2001) 239). If they cannot, the damping has the size of the
// curvature |Phi| Phi_qq.
template <class Body>
double ProjectorOf<Body>::approach(double t, const Y& angles, Y& y, Y& theta_bar, Y& rho_bar) {
  constexpr int kMost = 100;
  constexpr double kStationary = 1e-12;  // relative fall of |Phi| per step
  const auto read = [&] {
    read_hat(t, y);
    displace(Y::Zero(N * data_.n));
    constraints_.phi(frames_, laws_, angles, phi_);
    return phi_.norm();
  };
  double violation = read(), damping = 1;
  Y trial = y;
  for (int k = 0; k < kMost && violation > kProjectionRounding; ++k) {
    rows_.evaluate(frames_);
    rows_.write_dense(J_);
    const Y gradient = J_.transpose() * phi_;
    Eigen::MatrixXd A = J_.transpose() * J_;
    A.diagonal().array() += damping * violation;
    Y step = cholesky_solve(A, -gradient);
    const double longest = step.cwiseAbs().maxCoeff();
    limit_turns(step);
    displace(step);
    trial = y;
    for_bodies([&](Body& b, std::size_t, auto& f) { b.start_velocity(f), b.write(f, trial); });
    std::swap(y, trial);
    const double before = violation;
    violation = read();
    if (violation < before) {
      damping = std::max(damping / 4, 1e-3);
      if (before - violation <= kStationary * before) break;
    } else {
      std::swap(y, trial);
      violation = read();
      if (longest < kStationary) break;
      damping *= 4;
    }
  }
  mu_ = -phi_;
  for (auto& bar : bars_) bar.set_zero();
  add_pull_back(frames_, {nullptr, &mu_, nullptr, nullptr}, theta_bar, rho_bar);
  for (auto& bar : bars_) bar.set_zero();
  return violation;
}

}  // namespace mbsopt
