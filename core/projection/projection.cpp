#include "core/projection/projection.hpp"

#include <algorithm>
#include <cmath>

#include "core/linear/dense.hpp"
#include "core/projection/body_in_plane.hpp"
#include "core/projection/body_in_space.hpp"
#include "core/projection/projection_iterations.hpp"

namespace mbsopt {

ProjectionSolution Projector::solution() const {
  ProjectionSolution s;
  const std::size_t n = active() ? at(data_.n) : 0;
  s.delta.assign(n, Vec<6>::Zero());
  s.u.assign(n, Vec<6>::Zero());
  s.nu.setZero(active() ? data_.m : 0);
  s.kappa.setZero(active() ? data_.m : 0);
  return s;
}

namespace {

// More unknowns than these are solved faster by blocks.
constexpr Eigen::Index kDenseUnknowns = 48;

// Accelerations of body i (1-based), of size 1, that no symmetry of a mechanism leaves a direction out of.
template <int N>
Vec<N> test_load(int i) {
  Vec<N> x;
  for (int k = 0; k < N; ++k) x(k) = std::cos(1.0 + 2.7 * (N * i + k) + 0.31 * i * i);
  return x;
}

// Bodies are counted without the ground, frames with it.
template <class Body>
class ProjectorOf final : public Projector {
  using Space = typename Body::Space;
  using Direction = typename Body::Direction;
  using Gradient = typename Body::Gradient;
  static constexpr int N = Space::kUnknowns;

 public:
  ProjectorOf(const Mechanism& mechanism, Projection what, Free free);

  bool project(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y,
               ProjectionSolution& s) override;
  bool settle(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) override;
  bool assemble(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, Eigen::VectorXd& y) override;
  double approach(double t, const Eigen::VectorXd& angles, Eigen::VectorXd& y, Eigen::VectorXd& theta_bar,
                  Eigen::VectorXd& rho_bar) override;
  bool linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat, const Eigen::VectorXd& y,
                 const ProjectionSolution& s) override;
  void tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) override {
    set_tangent(block, y_hat_dir, true, y_dir);
  }
  void position_tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) override {
    set_tangent(block, y_hat_dir, false, y_dir);
  }
  void add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                   Eigen::VectorXd& rho_bar) override;
  void response(Eigen::VectorXd& out) override;
  double position_violation(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y) override;
  double velocity_violation(double t, const Eigen::VectorXd& y) override;
  long factorisations() const override { return solver_.factorisations() + square_factorisations_; }

 private:
  using X = Vec<N>;
  using Y = Eigen::VectorXd;
  using Frames = std::vector<typename Space::Frame>;

  bool constrained() const { return rows_.count() > 0; }
  void read_hat(double t, const Y& y_hat);
  bool factor(double t, const Y& y_hat);                // of S(q~)
  bool factor_square();                                 // J at the frames
  void solve_square(const Y& rows, std::vector<X>& x);  // J x = rows
  // Calls f(body, its number without the ground, its frame).
  template <class F>
  void for_bodies(F&& f) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) f(bodies_[i], i, frames_[i + 1]);
  }
  X test_load_of(int body) const;
  // Directions of Phi or Phidot (dirs_) and of J'lambda (load_dirs_), along frame_dirs_ and those of the fields.
  void set_tangents(ProjectionLevel level, const Frames& frames, const ParameterBlock& block, const Y& lambda);
  void set_field_tangents(const ParameterBlock& block);  // Phi' at q along the fields into dirs_, bodies at rest
  // b_lanes_ = -(M' x + (J'lambda)')
  void set_loads(const ParameterBlock& block, const std::vector<X>& x);
  void set_tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, bool velocities, LaneRows& y_dir);
  void refine_tangent(ProjectionLevel level, const LargestEntries<Direction>& size);
  void refine_adjoint(ProjectionLevel level);
  void add_pull_back(Frames& frames, const ConstraintWeights& weights, Y& theta_bar, Y& rho_bar) {
    constraints_.add_pull_back(frames, laws_, angles_, weights, -1, bars_, theta_bar, rho_bar);
  }
  void subtract_mass_bar(const std::vector<X>& x, Y& theta_bar) const {
    for (std::size_t i = 0; i < x.size(); ++i) Space::subtract_mass_bar(data_, i + 1, x_[i], x[i], theta_bar);
  }

  const bool square_;  // J, which is factored as it is
  long square_factorisations_ = 0;
  SquareFactor J_factor_;
  Eigen::MatrixXd J_;
  ProjectionSolution settled_;

  BlockSaddleSolver<typename Space::Rows> solver_;  // factor of S(q~)
  typename Space::Rows rows_;                       // J at the projected q
  typename Space::Constraints constraints_;
  RowLaws laws_;
  Y angles_;

  std::vector<Body> bodies_;
  Frames frames_, frames_tilde_;
  std::vector<X> delta_, u_, b_, x_;
  Y nu_, kappa_, phi_, g_, mu_;
  Corrections<X, Y> corrections_;
  std::vector<typename Space::FrameBar> bars_;
  std::vector<Gradient> q_bars_, v_bars_;
  // Lanes.
  std::vector<typename Space::FrameTangent> frame_dirs_;
  std::vector<Direction> q_dirs_, v_dirs_;
  std::vector<Lanes<N>> load_dirs_, b_lanes_, x_lanes_;
  ConstraintTangents dirs_;
  LaneRows g_lanes_, nu_lanes_;
  Corrections<Lanes<N>, LaneRows> corrections_of_lanes_;
};

template <class Body>
ProjectorOf<Body>::ProjectorOf(const Mechanism& mechanism, Projection what, Free free)
    : Projector(mechanism, what),
      square_(free == Free::nothing && Space::rows(data_) == N * data_.n && N * data_.n <= kDenseUnknowns),
      settled_(solution()),
      solver_(data_, kProjectionAlpha * rows_of<Space>(data_, data_.row_alpha)),
      rows_(data_),
      constraints_(data_),
      laws_(Space::laws(data_)) {
  const std::size_t n = at(data_.n);
  const Eigen::Index m = rows_.count();
  for (int i = 1; i <= data_.n; ++i) bodies_.emplace_back(data_, i, positions());
  frames_.resize(n + 1), frames_tilde_.resize(n + 1), bars_.resize(n + 1), load_dirs_.resize(n + 1);
  frame_dirs_.assign(n + 1, Space::still());
  q_bars_.resize(n), v_bars_.resize(n), q_dirs_.resize(n), v_dirs_.resize(n);
  for (auto* x : {&delta_, &u_, &b_, &x_, &corrections_.r, &corrections_.dx, &corrections_.Ex}) x->resize(n);
  for (Y* x : {&nu_, &kappa_, &phi_, &g_, &mu_, &corrections_.rg, &corrections_.dnu}) x->setZero(m);
  angles_.setZero(static_cast<Eigen::Index>(data_.angles.size()));
  auto& lanes = corrections_of_lanes_;
  for (auto* x : {&b_lanes_, &x_lanes_, &lanes.r, &lanes.dx, &lanes.Ex}) x->resize(n);
  for (LaneRows* x : {&dirs_.phi, &dirs_.phi_dot, &dirs_.phi_ddot, &g_lanes_, &nu_lanes_, &lanes.rg, &lanes.dnu}) {
    x->setZero(m, kLanes);
  }
}

template <class Body>
void ProjectorOf<Body>::read_hat(double t, const Y& y_hat) {
  laws_.set_time(t);
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].read_hat(y_hat, frames_tilde_[i + 1]);
}
template <class Body>
bool ProjectorOf<Body>::factor(double t, const Y& y_hat) {
  read_hat(t, y_hat);
  return solver_.factor(frames_tilde_);
}

template <class Body>
bool ProjectorOf<Body>::factor_square() {
  rows_.evaluate(frames_);
  J_ = rows_.dense();
  ++square_factorisations_;
  return J_factor_.compute(J_);
}
template <class Body>
void ProjectorOf<Body>::solve_square(const Y& rows, std::vector<X>& x) {
  Eigen::Map<Y> all(x[0].data(), N * static_cast<Eigen::Index>(x.size()));
  all = rows;
  J_factor_.solve(all);
}

// Newton's method; a turn of each body by dx adds to delta to first order.
template <class Body>
bool ProjectorOf<Body>::settle(double t, const Y& angles, const Y& y_hat, Y& y) {
  if (!square_) return project(t, angles, y_hat, y, settled_);
  read_hat(t, y_hat);
  const Eigen::Index half = 7 * data_.n;
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  std::vector<X>& dx = corrections_.dx;
  // Calls step() until |phi| is rounding; false where it does not fall before.
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
        for (std::size_t i = 0; i < dx.size(); ++i) dx[i] = -dx[i], u_[i] += dx[i];
        for_bodies([&](Body& b, std::size_t i, auto& f) { b.add_velocity(u_[i], dx[i], f); });
        return true;
      });
  if (!moves) return false;
  y = y_hat;
  for_bodies([&](Body& b, std::size_t, auto& f) { b.write(f, y); });
  return y.allFinite();
}

// Small steps follow the flow qdot = -J^-1 Phi, along which Phi falls as exp(-s) and det J cannot change its sign.
template <class Body>
bool ProjectorOf<Body>::assemble(double t, const Y& angles, const Y& y_hat, Y& y) {
  constexpr int kMost = 100;
  constexpr double kLongest = 0.5;    // of a turn in one step [rad]
  constexpr double kShortest = 1e-3;  // part of a step: det J vanishes on the way, or |Phi| has a least value
  if (!square_) return false;
  double sign = 0;
  // |Phi| beside the state that was read, with J_ there; infinite where det J has another sign than at the guess.
  const auto violation_at = [&](const Y& moved) {
    for_bodies(
        [&](Body& b, std::size_t i, auto& f) { b.displace(moved.segment<N>(N * static_cast<Eigen::Index>(i)), f); });
    constraints_.phi(frames_, laws_, angles, phi_);
    rows_.evaluate(frames_);
    J_ = rows_.dense();
    const double determinant = J_.determinant();
    if (sign == 0) sign = determinant;
    return determinant * sign > 0 ? phi_.norm() : INFINITY;
  };
  Y reached = y_hat;
  read_hat(t, reached);
  double violation = violation_at(Y::Zero(N * data_.n));
  const double size = std::max(1.0, y_hat.head(7 * data_.n).cwiseAbs().maxCoeff());
  for (int k = 0; k < kMost && violation > kUnmetPosition * size; ++k) {
    ++square_factorisations_;
    if (!std::isfinite(violation) || !J_factor_.compute(J_)) return false;
    Y step = -phi_;
    J_factor_.solve(step);
    double turn = 0;
    constexpr Eigen::Index kTurns = N == 3 ? 1 : 3;  // the last unknowns of a body
    for (Eigen::Index i = N - kTurns; i < step.size(); i += N)
      turn = std::max(turn, step.segment<kTurns>(i).cwiseAbs().maxCoeff());
    if (turn > kLongest) step *= kLongest / turn;
    double part = 1, now = violation_at(step);
    while (!(now < violation)) {
      if ((part /= 2) < kShortest) return false;
      now = violation_at(part * step);
    }
    violation = now;
    for_bodies([&](Body& b, std::size_t, auto& f) { b.start_velocity(f), b.write(f, reached); });
    read_hat(t, reached);
  }
  reached.tail(7 * data_.n) = y_hat.tail(7 * data_.n);
  return settle(t, angles, reached, y);
}

// Levenberg-Marquardt with a damping of the size of |Phi|: quadratic where the constraints can hold (Yamashita and
// Fukushima, Computing Supplementum 15 (2001) 239); and of the size of the curvature |Phi| Phi_qq where they cannot.
template <class Body>
double ProjectorOf<Body>::approach(double t, const Y& angles, Y& y, Y& theta_bar, Y& rho_bar) {
  constexpr int kMost = 100;
  constexpr double kStationary = 1e-12;  // relative fall of |Phi| per step
  constexpr double kLongest = 0.5;       // of a turn in one step [rad]
  const auto read = [&] {
    read_hat(t, y);
    for_bodies([&](Body& b, std::size_t, auto& f) { b.displace(X::Zero(), f); });
    constraints_.phi(frames_, laws_, angles, phi_);
    return phi_.norm();
  };
  double violation = read(), damping = 1;
  Y trial = y;
  for (int k = 0; k < kMost && violation > kProjectionRounding; ++k) {
    rows_.evaluate(frames_);
    J_ = rows_.dense();
    const Y gradient = J_.transpose() * phi_;
    Eigen::MatrixXd A = J_.transpose() * J_;
    A.diagonal().array() += damping * violation;
    Y step = cholesky_solve(A, -gradient);
    const double longest = step.cwiseAbs().maxCoeff();
    double turn = 0;
    for (Eigen::Index i = N - 1; i < step.size(); i += N) turn = std::max(turn, std::abs(step(i)));
    if (turn > kLongest) step *= kLongest / turn;
    for_bodies([&](Body& b, std::size_t i, auto& f) {
      b.displace(step.segment<N>(N * static_cast<Eigen::Index>(i)), f);
      b.start_velocity(f);
    });
    trial = y;
    for_bodies([&](Body& b, std::size_t, auto& f) { b.write(f, trial); });
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

template <class Body>
bool ProjectorOf<Body>::project(double t, const Y& angles, const Y& y_hat, Y& y, ProjectionSolution& s) {
  if (!factor(t, y_hat)) return false;
  const Eigen::Index half = 7 * data_.n;
  const double q_size = std::max(1.0, y_hat.head(half).cwiseAbs().maxCoeff()),
               v_size = std::max(1.0, y_hat.tail(half).cwiseAbs().maxCoeff());
  const auto displace = [&](const std::vector<X>&) {
    for_bodies([&](Body& b, std::size_t i, auto& f) { b.displace(delta_[i], f); });
  };
  for (X& d : delta_) d.setZero();
  nu_.setZero();
  displace(delta_);
  const auto phi = [&](Y& out) { constraints_.phi(frames_, laws_, angles, out); };
  if (positions() &&
      !onto_constraints(solver_, solver_.rows(), q_size, kUnmetPosition, delta_, nu_, corrections_, phi, displace))
    return false;

  for_bodies([](Body& b, std::size_t, auto& f) { b.start_velocity(f); });
  rows_.evaluate(frames_);
  const auto phi_dot = [&](Y& out) { constraints_.phi_dot(frames_, laws_, out); };
  const auto add_velocity = [&](const std::vector<X>& du) {
    for_bodies([&](Body& b, std::size_t i, auto& f) { b.add_velocity(u_[i], du[i], f); });
  };
  if (!onto_constraints(solver_, rows_, v_size, kUnmetVelocity, u_, kappa_, corrections_, phi_dot, add_velocity))
    return false;

  y = y_hat;
  for_bodies([&](Body& b, std::size_t i, auto& f) {
    b.write(f, y);
    s.delta[i].template head<N>() = delta_[i];
    s.u[i].template head<N>() = u_[i];
  });
  Space::spread(data_, nu_, s.nu), Space::spread(data_, kappa_, s.kappa);
  return y.allFinite();
}

// In the plane where there is one, so that both models take the same steps.
template <>
Vec<6> ProjectorOf<BodyInSpace>::test_load_of(int body) const {
  return data_.planar ? PlanarBodies(*data_.planar).in_space(at(body), test_load<3>(body)) : test_load<6>(body);
}
template <>
Vec<3> ProjectorOf<BodyInPlane>::test_load_of(int body) const {
  return test_load<3>(body);
}

template <class Body>
void ProjectorOf<Body>::response(Y& out) {
  for (std::size_t i = 0; i < b_.size(); ++i) {
    const int body = static_cast<int>(i) + 1;
    b_[i] = solver_.mass_times(body, test_load_of(body));
  }
  g_.setZero();
  solver_.solve(b_, g_, Refinements{}, corrections_.dx, corrections_.dnu);
  g_ = kProjectionAlpha * corrections_.dnu.cwiseQuotient(solver_.alpha());
  for (X& b : b_) b.setZero();
  solver_.solve(b_, g_, Refinements{}, corrections_.dx, corrections_.dnu);
  out = kProjectionAlpha * corrections_.dnu.cwiseQuotient(solver_.alpha());
}

template <class Body>
double ProjectorOf<Body>::position_violation(double t, const Y& angles, const Y& y) {
  laws_.set_time(t);
  for_bodies([&](Body& b, std::size_t, auto& f) { b.read_position(y, f); });
  constraints_.phi(frames_, laws_, angles, phi_);
  double worst = constrained() ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (const Body& b : bodies_) worst = std::max(worst, b.norm_violation());
  return worst;
}

template <class Body>
double ProjectorOf<Body>::velocity_violation(double t, const Y& y) {
  laws_.set_time(t);
  for_bodies([&](Body& b, std::size_t, auto& f) { b.read_position(y, f), b.read_velocity(y, f); });
  constraints_.phi_dot(frames_, laws_, phi_);
  double worst = constrained() ? phi_.cwiseAbs().maxCoeff() : 0.0;
  for (const Body& b : bodies_) worst = std::max(worst, b.norm_rate_violation());
  return worst;
}

template <class Body>
bool ProjectorOf<Body>::linearise(double t, const Y& angles, const Y& y_hat, const Y& y, const ProjectionSolution& s) {
  angles_ = angles;
  if (square_)
    read_hat(t, y_hat);
  else if (!factor(t, y_hat))
    return false;
  Space::gather(data_, s.nu, nu_), Space::gather(data_, s.kappa, kappa_);
  for_bodies([&](Body& b, std::size_t i, auto& f) {
    delta_[i] = s.delta[i].template head<N>(), u_[i] = s.u[i].template head<N>();
    b.displace(delta_[i], f);
    b.restore_velocity(y, u_[i], f);
  });
  if (square_) return factor_square();
  rows_.evaluate(frames_);
  return true;
}

template <>
void ProjectorOf<BodyInSpace>::set_tangents(ProjectionLevel, const Frames& frames, const ParameterBlock& block,
                                            const Y& lambda) {
  for (Lanes<6>& load : load_dirs_) load.setZero();
  constraints_.tangents(frames, frame_dirs_, laws_, angles_, block, lambda, dirs_, load_dirs_);
}
template <>
void ProjectorOf<BodyInPlane>::set_tangents(ProjectionLevel level, const Frames&, const ParameterBlock& block,
                                            const Y& lambda) {
  using Order = PlanarConstraints::Order;
  for (Lanes<3>& load : load_dirs_) load.setZero();
  constraints_.tangents(level == ProjectionLevel::position ? Order::phi : Order::phi_dot, frame_dirs_, laws_, angles_,
                        block, lambda, dirs_, load_dirs_);
}

template <>
void ProjectorOf<BodyInSpace>::set_field_tangents(const ParameterBlock& block) {
  mu_.setZero();
  constraints_.field_tangents(frames_, laws_, angles_, block, mu_, dirs_, load_dirs_);
}
template <>
void ProjectorOf<BodyInPlane>::set_field_tangents(const ParameterBlock& block) {
  constraints_.field_tangents(frames_, laws_, angles_, block, dirs_.phi);
}

template <class Body>
void ProjectorOf<Body>::set_loads(const ParameterBlock& block, const std::vector<X>& x) {
  for (std::size_t i = 0; i < x.size(); ++i) {
    b_lanes_[i] = -load_dirs_[i + 1];
    Space::subtract_mass_tangent(data_, i + 1, block, x[i], b_lanes_[i]);
  }
}

template <class Body>
void ProjectorOf<Body>::refine_tangent(ProjectionLevel level, const LargestEntries<Direction>& size) {
  if (square_) {  // J x = g settles x, and nu is 0
    Eigen::Map<LaneRows> x(x_lanes_[0].data(), rows_.count(), kLanes);
    x = g_lanes_;
    J_factor_.solve_lanes(x);
    return;
  }
  const auto turn = [&](std::vector<Lanes<N>>& x, bool transposed) {
    for (std::size_t i = 0; i < x.size(); ++i) bodies_[i].turn_by_E(x[i], transposed);
  };
  refine(solver_, rows_, level, false, size, b_lanes_, g_lanes_, x_lanes_, nu_lanes_, corrections_of_lanes_, turn);
}

template <class Body>
void ProjectorOf<Body>::refine_adjoint(ProjectionLevel level) {
  if (square_) {  // x = 0, J'mu = b
    mu_ = Eigen::Map<const Y>(b_[0].data(), rows_.count());
    J_factor_.solve_transposed(mu_);
    for (X& x : x_) x.setZero();
    return;
  }
  const auto turn = [&](std::vector<X>& x, bool transposed) {
    for (std::size_t i = 0; i < x.size(); ++i) bodies_[i].turn_by_E(x[i], transposed);
  };
  g_.setZero();
  refine(solver_, rows_, level, true, LargestEntries<X>::Zero(), b_, g_, x_, mu_, corrections_, turn);
}

template <class Body>
void ProjectorOf<Body>::set_tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, bool velocities,
                                    LaneRows& y_dir) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].tilde_tangent(y_hat_dir, frames_tilde_[i + 1], q_dirs_[i], frame_dirs_[i + 1]);
  }
  if (positions()) {
    if (!square_) {  // else nu and delta are 0
      set_tangents(ProjectionLevel::position, frames_tilde_, block, nu_);
      set_loads(block, delta_);
    }
    for_bodies(
        [&](const Body& b, std::size_t i, const auto&) { b.position_tangent(delta_[i], q_dirs_[i], x_lanes_[i]); });
    set_field_tangents(block);
    g_lanes_ = -dirs_.phi;
    rows_.subtract_times(x_lanes_, g_lanes_);  // J x, since p' turns a unit p
    refine_tangent(ProjectionLevel::position, largest(x_lanes_));
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b.add_displacement(x_lanes_[i], q_dirs_[i]); });
  }

  if (velocities) {
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.velocity_tangent(y_hat_dir, u_[i], f, q_dirs_[i], v_dirs_[i], frame_dirs_[i + 1]);
    });
  }
  if (velocities && constrained()) {
    set_tangents(ProjectionLevel::velocity, frames_, block, kappa_);
    set_loads(block, u_);
    g_lanes_ = -dirs_.phi_dot;
    refine_tangent(ProjectionLevel::velocity, largest(v_dirs_));
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b.add_velocity_tangent(x_lanes_[i], v_dirs_[i]); });
  }
  y_dir = y_hat_dir;
  for_bodies([&](const Body& b, std::size_t i, const auto&) {
    b.write_position_tangent(q_dirs_[i], y_hat_dir, y_dir);
    if (velocities) b.write_velocity_tangent(q_dirs_[i], v_dirs_[i], y_hat_dir, y_dir);
  });
}

template <class Body>
void ProjectorOf<Body>::add_adjoint(const Y& y_bar, Y& y_hat_bar, Y& theta_bar, Y& rho_bar) {
  for_bodies([&](const Body& b, std::size_t i, const auto&) { b.start_adjoint(y_bar, q_bars_[i], v_bars_[i]); });

  // Velocities: (eta, chi) from v_bar; then the gradient of v_bar'v - eta'(M u + J'kappa) - chi'Phidot.
  for (auto& bar : bars_) bar.set_zero();
  if (constrained()) {
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b_[i] = b.u_bar(v_bars_[i]); });
    refine_adjoint(ProjectionLevel::velocity);
    for_bodies([&](const Body&, std::size_t i, auto& f) { set_virtual(x_[i], f); });
    add_pull_back(frames_, {&kappa_, nullptr, &mu_, nullptr}, theta_bar, rho_bar);
    subtract_mass_bar(u_, theta_bar);
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.pull_back_velocity(f, bars_[i + 1], q_bars_[i], v_bars_[i]);
      bars_[i + 1].set_zero();
    });
  }
  for_bodies([&](const Body& b, std::size_t i, const auto&) { b.pull_back_start(u_[i], q_bars_[i], v_bars_[i]); });

  // Positions: (eta, chi) from delta's cotangent; then the gradient of q_bar'q - eta'(M delta + J~'nu) - chi'Phi(q).
  if (constrained() && positions()) {
    for_bodies([&](const Body& b, std::size_t i, const auto&) { b_[i] = b.delta_bar(q_bars_[i]); });
    refine_adjoint(ProjectionLevel::position);
    add_pull_back(frames_, {nullptr, &mu_, nullptr, nullptr}, theta_bar, rho_bar);
    for_bodies([&](const Body& b, std::size_t i, const auto& f) {
      b.pull_back_position(f, bars_[i + 1], q_bars_[i]);
      bars_[i + 1].set_zero();
      set_virtual(x_[i], frames_tilde_[i + 1]);
    });
    add_pull_back(frames_tilde_, {&nu_, nullptr, nullptr, nullptr}, theta_bar, rho_bar);
    subtract_mass_bar(delta_, theta_bar);
  }
  for_bodies([&](const Body& b, std::size_t i, const auto&) {
    b.finish_adjoint(delta_[i], frames_tilde_[i + 1], bars_[i + 1], y_bar, q_bars_[i], v_bars_[i], y_hat_bar);
  });
}

}  // namespace

std::unique_ptr<Projector> make_projector(const Mechanism& mechanism, Projection what, Model model, Free free) {
  if (model == Model::planar) return std::make_unique<ProjectorOf<BodyInPlane>>(mechanism, what, free);
  return std::make_unique<ProjectorOf<BodyInSpace>>(mechanism, what, free);
}

}  // namespace mbsopt
