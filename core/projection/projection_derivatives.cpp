// Tangent and adjoint of the projection: the derivatives of its optimality conditions (projection.hpp).
#include <algorithm>
#include <cmath>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/projection/projection.hpp"

namespace mbsopt {
namespace {

// p' of p = pi/|pi|, for one direction or lanes of pi'.
template <class X>
X normalised_direction(const Vector4d& p, double norm, const X& pi_dir) {
  X out = pi_dir;
  out.noalias() -= p * (p.transpose() * pi_dir);
  return out / norm;
}

Lanes<4> G_transposed_times_lanes(const Vector4d& p, const Lanes<3>& w) {
  Lanes<4> out;
  const Vector3d e = p.tail<3>();
  out.row(0) = -dot(e, w);
  out.bottomRows<3>() = p(0) * w + cross(e, w);
  return out;
}
// G(p')' w for lanes of p'.
Lanes<4> G_transposed_direction(const Lanes<4>& p_dir, const Vector3d& w) {
  Lanes<4> out;
  out.row(0) = -dot(w, p_dir.bottomRows<3>());
  out.bottomRows<3>() = w * p_dir.row(0) - cross(w, p_dir.bottomRows<3>());
  return out;
}

}  // namespace

bool Projector::linearise(double t, const Eigen::VectorXd& angles, const Eigen::VectorXd& y_hat,
                          const Eigen::VectorXd& y, const ProjectionSolution& solution) {
  if (planar_) return planar_->linearise(t, angles, y_hat, y, solution);
  laws_.set_time(t);
  angles_ = angles;
  solution_ = &solution;
  prepare_bodies(y_hat);
  set_frames(scratch_y_, nullptr, states_tilde_, frames_tilde_);
  if (!solver_.factor(frames_tilde_)) return false;
  for (int i = 1; i <= data_.n; ++i) {
    Body& b = bodies_[at(i)];
    const Vec<6>& d = solution.delta[at(i - 1)];
    b.pi = b.p_tilde + 0.5 * G_transposed_times(b.p_tilde, d.tail<3>());
    b.norm_pi = positions() ? b.pi.norm() : 1.0;
    b.p = b.pi / b.norm_pi;
    b.pdot = y.segment<4>(7 * (data_.n + i - 1) + 3);
    // E = G(p) (I - p p') G(p~)'/|pi| and G(p) p = 0
    for (int k = 0; k < 3; ++k) {
      b.E.col(k) = G_times(b.p, G_transposed_times(b.p_tilde, Vector3d::Unit(k))) / b.norm_pi;
    }
  }
  set_frames(y, &y, states_, frames_);
  rows_.evaluate(frames_);
  return true;
}

template <class X>
void Projector::turn_by_E(std::vector<X>& x, bool transposed) const {
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Matrix3d& E = bodies_[i + 1].E;
    const auto turns = x[i].template bottomRows<3>().eval();
    x[i].template bottomRows<3>().noalias() = transposed ? (E.transpose() * turns).eval() : (E * turns).eval();
  }
}

void Projector::tangent(const ParameterBlock& block, const LaneRows& y_hat_dir, LaneRows& y_dir) {
  if (planar_) return planar_->tangent(block, y_hat_dir, y_dir);
  const int n = data_.n;
  const Eigen::Index half = 7 * n;
  const ProjectionSolution& s = *solution_;
  const auto E = [&](std::vector<Lanes<6>>& x, bool transposed) { turn_by_E(x, transposed); };
  auto mass_directions = [&](const std::vector<Vec<6>>& x) {  // b = -M' x - (J'nu)', loads_ holding (J'nu)'
    for (int i = 1; i <= n; ++i) {
      const BodyData& body = data_.bodies[at(i)];
      Lanes<6>& b = b_lanes_[at(i - 1)];
      b = -loads_[at(i)];
      Lanes<1> dm;
      if (const auto* m = block.field<1>(body.slot_mass, dm)) b.topRows<3>() -= x[at(i - 1)].head<3>() * *m;
      Lanes<6> storage;
      if (const auto* J = block.field<6>(body.slot_J, storage)) {
        const Vector3d w = x[at(i - 1)].tail<3>();
        b.row(3) -= w(0) * J->row(0) + w(1) * J->row(3) + w(2) * J->row(4);
        b.row(4) -= w(0) * J->row(3) + w(1) * J->row(1) + w(2) * J->row(5);
        b.row(5) -= w(0) * J->row(4) + w(1) * J->row(5) + w(2) * J->row(2);
      }
    }
  };
  const Lanes<7> none = Lanes<7>::Zero();

  // Positions. Directions of q~, then the right-hand sides.
  for (int i = 1; i <= n; ++i) {
    const Body& b = bodies_[at(i)];
    Lanes<7> q_tilde = y_hat_dir.middleRows<7>(7 * (i - 1));
    if (positions()) {
      const Lanes<4> p_hat_dir = q_tilde.bottomRows<4>();
      q_tilde.bottomRows<4>() = normalised_direction(b.p_tilde, b.norm_hat, p_hat_dir);
    }
    y_dir.middleRows<7>(7 * (i - 1)) = q_tilde;
    BodyState still = states_tilde_[at(i)];
    still.pdot.setZero(), still.omegadot.setZero();
    set_tangent(still, q_tilde, none, frame_dirs_[at(i)]);
  }
  if (positions()) {
    for (Lanes<6>& load : loads_) load.setZero();
    evaluate_tangents(data_, frames_tilde_, laws_, angles_, frame_dirs_, block, s.nu, dirs_, loads_);
    mass_directions(s.delta);
    // Direction of q with delta fixed, and Phi' along it: J times the displacement, since p' turns a unit p.
    for (int i = 1; i <= n; ++i) {
      const Body& b = bodies_[at(i)];
      auto q_dir = y_dir.middleRows<7>(7 * (i - 1));
      const Lanes<4> p_tilde_dir = q_dir.bottomRows<4>();
      const Lanes<4> pi_dir = p_tilde_dir + 0.5 * G_transposed_direction(p_tilde_dir, s.delta[at(i - 1)].tail<3>());
      const Lanes<4> p_dir = normalised_direction(b.p, b.norm_pi, pi_dir);
      q_dir.bottomRows<4>() = p_dir;
      x_lanes_[at(i - 1)].topRows<3>() = q_dir.topRows<3>();
      x_lanes_[at(i - 1)].bottomRows<3>().noalias() = (2 * G(b.p)) * p_dir;
    }
    for (Lanes<6>& load : loads_) load.setZero();
    mu_.setZero();
    evaluate_field_tangents(data_, frames_, laws_, angles_, block, mu_, dirs_, loads_);
    g_lanes_ = -dirs_.phi;
    rows_.subtract_times(x_lanes_, g_lanes_);
    refine(solver_, rows_, ProjectionLevel::position, false, largest(x_lanes_), b_lanes_, g_lanes_, x_lanes_, nu_lanes_,
           corrections_of_lanes_, E);
    for (int i = 1; i <= n; ++i) {
      const Body& b = bodies_[at(i)];
      const Lanes<6>& d = x_lanes_[at(i - 1)];
      auto q_dir = y_dir.middleRows<7>(7 * (i - 1));
      q_dir.topRows<3>() += d.topRows<3>();
      const Lanes<4> pi_dir = 0.5 * G_transposed_times_lanes(b.p_tilde, d.bottomRows<3>());
      q_dir.bottomRows<4>() += normalised_direction(b.p, b.norm_pi, pi_dir);
    }
  }

  // Velocities: v_n and T(q) u along q's direction, then u'.
  for (int i = 1; i <= n; ++i) {
    const Body& b = bodies_[at(i)];
    const Lanes<4> p_dir = y_dir.middleRows<4>(7 * (i - 1) + 3);
    const Lanes<7> v_hat_dir = y_hat_dir.middleRows<7>(half + 7 * (i - 1));
    auto v_dir = y_dir.middleRows<7>(half + 7 * (i - 1));
    v_dir = v_hat_dir;
    const double pp = b.p.squaredNorm(), along = b.p.dot(b.pdot_hat) / pp;
    const Lanes<1> along_dir = (b.pdot_hat.transpose() * p_dir + b.p.transpose() * v_hat_dir.bottomRows<4>() -
                                2 * along * (b.p.transpose() * p_dir)) /
                               pp;
    v_dir.bottomRows<4>() -= along * p_dir;
    v_dir.bottomRows<4>().noalias() -= b.p * along_dir;
    v_dir.bottomRows<4>() += 0.5 * G_transposed_direction(p_dir, s.u[at(i - 1)].tail<3>());
    BodyState still = states_[at(i)];
    still.omegadot.setZero();
    const Lanes<7> q_dir = y_dir.middleRows<7>(7 * (i - 1)), v_fixed = v_dir;
    set_tangent(still, q_dir, v_fixed, frame_dirs_[at(i)]);
  }
  if (data_.m == 0) return;
  for (Lanes<6>& load : loads_) load.setZero();
  evaluate_tangents(data_, frames_, laws_, angles_, frame_dirs_, block, s.kappa, dirs_, loads_);
  mass_directions(s.u);
  g_lanes_ = -dirs_.phi_dot;
  refine(solver_, rows_, ProjectionLevel::velocity, false,
         LargestEntries<Lanes<6>>(y_dir.bottomRows(half).cwiseAbs().colwise().maxCoeff().array()), b_lanes_, g_lanes_,
         x_lanes_, nu_lanes_, corrections_of_lanes_, E);
  for (int i = 1; i <= n; ++i) {
    const Lanes<6>& u = x_lanes_[at(i - 1)];
    y_dir.middleRows<3>(half + 7 * (i - 1)) += u.topRows<3>();
    y_dir.middleRows<4>(half + 7 * (i - 1) + 3) += 0.5 * G_transposed_times_lanes(bodies_[at(i)].p, u.bottomRows<3>());
  }
}

void Projector::add_adjoint(const Eigen::VectorXd& y_bar, Eigen::VectorXd& y_hat_bar, Eigen::VectorXd& theta_bar,
                            Eigen::VectorXd& rho_bar) {
  if (planar_) return planar_->add_adjoint(y_bar, y_hat_bar, theta_bar, rho_bar);
  const int n = data_.n;
  const Eigen::Index half = 7 * n;
  const ProjectionSolution& s = *solution_;
  const auto E = [&](std::vector<Vec<6>>& x, bool transposed) { turn_by_E(x, transposed); };
  auto add_mass = [&](const std::vector<Vec<6>>& eta, const std::vector<Vec<6>>& x) {  // -eta'M_theta x
    for (int i = 1; i <= n; ++i) {
      const BodyData& body = data_.bodies[at(i)];
      const Vec<6>&e = eta[at(i - 1)], &z = x[at(i - 1)];
      if (body.slot_mass >= 0) theta_bar(body.slot_mass) -= e.head<3>().dot(z.head<3>());
      if (body.slot_J >= 0) {
        const Matrix3d X = e.tail<3>() * z.tail<3>().transpose();
        Vec<6> entries;
        entries << X(0, 0), X(1, 1), X(2, 2), X(0, 1) + X(1, 0), X(0, 2) + X(2, 0), X(1, 2) + X(2, 1);
        theta_bar.segment<6>(body.slot_J) -= entries;
      }
    }
  };
  q_bar_ = y_bar.head(half);
  v_bar_ = y_bar.tail(half);

  // Velocities: (eta, chi) from v_bar; then the gradient of v_bar'v - eta'(M u + J'kappa) - chi'Phidot.
  if (data_.m > 0) {
    for (int i = 1; i <= n; ++i) {
      b_[at(i - 1)].head<3>() = v_bar_.segment<3>(7 * (i - 1));
      b_[at(i - 1)].tail<3>() = 0.5 * G_times(bodies_[at(i)].p, v_bar_.segment<4>(7 * (i - 1) + 3));
    }
    g_.setZero();
    refine(solver_, rows_, ProjectionLevel::velocity, true, LargestEntries<Vec<6>>::Zero(), b_, g_, x_, mu_,
           corrections_, E);
    for (FrameBar& bar : bars_) bar.set_zero();
    for (int i = 1; i <= n; ++i) set_virtual(x_[at(i - 1)], frames_[at(i)]);
    add_pull_back(data_, frames_, laws_, angles_, {&s.kappa, nullptr, &mu_, nullptr}, -1, bars_, theta_bar, rho_bar);
    add_mass(x_, s.u);
    for (int i = 1; i <= n; ++i) {
      FrameBar& bar = bars_[at(i)];
      fold_virtual(x_[at(i - 1)].tail<3>(), bar);
      add_pull_back_velocity(states_[at(i)], bar, 1, q_bar_.segment<7>(7 * (i - 1)), v_bar_.segment<7>(7 * (i - 1)));
    }
  }
  for (int i = 1; i <= n; ++i) {
    const Body& b = bodies_[at(i)];
    auto p_bar = q_bar_.segment<4>(7 * (i - 1) + 3);
    const Vector4d pdot_bar = v_bar_.segment<4>(7 * (i - 1) + 3);
    // v = v_n + T(p) u,  pdot_n = pdot^ - p (p'pdot^)/(p'p)
    const double pp = b.p.squaredNorm(), along = b.p.dot(b.pdot_hat) / pp, across = b.p.dot(pdot_bar);
    p_bar += 0.5 * G_transposed_times_adjoint(s.u[at(i - 1)].tail<3>(), pdot_bar);
    p_bar -= along * pdot_bar + (across / pp) * (b.pdot_hat - 2 * along * b.p);
    y_hat_bar.segment<3>(half + 7 * (i - 1)) += v_bar_.segment<3>(7 * (i - 1));
    y_hat_bar.segment<4>(half + 7 * (i - 1) + 3) += pdot_bar - b.p * (across / pp);
  }
  if (!positions()) {
    y_hat_bar.head(half) += q_bar_;
    return;
  }

  // Positions: (eta, chi) from delta's cotangent; then the gradient of q_bar'q - eta'(M delta + J~'nu) - chi'Phi(q).
  auto pi_bar_of = [&](int i) {
    const Body& b = bodies_[at(i)];
    const Vector4d p_bar = q_bar_.segment<4>(7 * (i - 1) + 3);
    return Vector4d((p_bar - b.p * b.p.dot(p_bar)) / b.norm_pi);
  };
  for (FrameBar& bar : bars_) bar.set_zero();
  if (data_.m > 0) {
    for (int i = 1; i <= n; ++i) {
      b_[at(i - 1)].head<3>() = q_bar_.segment<3>(7 * (i - 1));
      b_[at(i - 1)].tail<3>() = 0.5 * G_times(bodies_[at(i)].p_tilde, pi_bar_of(i));
    }
    g_.setZero();
    refine(solver_, rows_, ProjectionLevel::position, true, LargestEntries<Vec<6>>::Zero(), b_, g_, x_, mu_,
           corrections_, E);
    add_pull_back(data_, frames_, laws_, angles_, {nullptr, &mu_, nullptr, nullptr}, -1, bars_, theta_bar, rho_bar);
    for (int i = 1; i <= n; ++i) {
      q_bar_.segment<7>(7 * (i - 1)) += pull_back_position(states_[at(i)], bars_[at(i)]);
      bars_[at(i)].set_zero();
      set_virtual(x_[at(i - 1)], frames_tilde_[at(i)]);
    }
    add_pull_back(data_, frames_tilde_, laws_, angles_, {&s.nu, nullptr, nullptr, nullptr}, -1, bars_, theta_bar,
                  rho_bar);
    add_mass(x_, s.delta);
  }
  for (int i = 1; i <= n; ++i) {
    const Body& b = bodies_[at(i)];
    const Vector4d pi_bar = pi_bar_of(i);
    FrameBar& bar = bars_[at(i)];
    Vector4d p_tilde_bar = pi_bar + 0.5 * G_transposed_times_adjoint(s.delta[at(i - 1)].tail<3>(), pi_bar);
    auto r_hat_bar = y_hat_bar.segment<3>(7 * (i - 1));
    r_hat_bar += q_bar_.segment<3>(7 * (i - 1));
    if (data_.m > 0) {
      fold_virtual(x_[at(i - 1)].tail<3>(), bar);
      const Vec<7> q_tilde_bar = pull_back_position(states_tilde_[at(i)], bar);  // J~ of a distance or dot-2: of r too
      r_hat_bar += q_tilde_bar.head<3>();
      p_tilde_bar += q_tilde_bar.tail<4>();
    }
    y_hat_bar.segment<4>(7 * (i - 1) + 3) += (p_tilde_bar - b.p_tilde * b.p_tilde.dot(p_tilde_bar)) / b.norm_hat;
  }
}

}  // namespace mbsopt
