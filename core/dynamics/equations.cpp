// The equations of motion as residuals in (a, lambda), for implicit methods, with derivatives in y and the parameters.
//
//   omegadot = 2 G(p) a_p/(p'p) keeps the part of a_p = pddot that turns the body; the other part has its own equation,
//   p'a_p + (pdot'pdot)(p'p) = 0. With a fixed,  omegadot' = -2/(p'p) (G(a_p) p' + omegadot (p'p')).
#include <cassert>

#include "core/body/euler_parameters.hpp"
#include "core/body/lanes.hpp"
#include "core/dynamics/dynamics.hpp"

namespace mbsopt {
namespace {

Lanes<1> dot(const Vector4d& a, const Lanes<4>& b) {
  return a(0) * b.row(0) + a(1) * b.row(1) + a(2) * b.row(2) + a(3) * b.row(3);
}

}  // namespace

void Dynamics::set_motion(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                          const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  set_time_and_angles(t, y, angles);
  for (int i = 1; i <= data_.n; ++i) set_body(y, i);
  a_ = a;
  lambda_ = lambda;
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const Eigen::Index q = 7 * (i - 1);
    const Vector4d& p = bodies_[k].p;
    z_[k - 1].head<3>() = a.segment<3>(q);
    z_[k - 1].tail<3>() = (2 / p.squaredNorm()) * G_times(p, a.segment<4>(q + 3));
  }
  linearise_here();
}

void Dynamics::place_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                        const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  assert(!planar_);
  ++linearised_states_;
  set_motion(t, y, angles, a, lambda);
  solver_.place(frames_);
}

void Dynamics::residual(Eigen::Ref<Eigen::VectorXd> r) {
  for (int i = 1; i <= data_.n; ++i) set_own_load(i);
  add_forces();
  for (int i = 1; i <= data_.n; ++i)
    loads_[static_cast<std::size_t>(i) - 1] -= solver_.mass_times(i, z_[static_cast<std::size_t>(i) - 1]);
  solver_.rows().subtract_transposed_times(lambda_, loads_);
  constraints_.phi_ddot(frames_, laws_, gamma_);
  if (settings_.omega != 0) {
    constraints_.phi(frames_, laws_, angles_, phi_);
    constraints_.phi_dot(frames_, laws_, phi_dot_);
    gamma_ += 2 * settings_.xi * settings_.omega * phi_dot_ + settings_.omega * settings_.omega * phi_;
  }
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const Eigen::Index row = 7 * (i - 1);
    const Vector4d &p = bodies_[k].p, &pdot = bodies_[k].pdot;
    r.segment<6>(row) = loads_[k - 1];
    r(row + 6) = -p.dot(a_.segment<4>(row + 3)) - pdot.squaredNorm() * p.squaredNorm();
  }
  r.tail(data_.m) = compliance() * lambda_ - gamma_;
}

void Dynamics::residual_tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& r_dir) {
  const int n = data_.n;
  right_hand_side_tangent(block, y_dir);
  for (int i = 1; i <= n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const Eigen::Index row = 7 * (i - 1);
    const Vector4d &p = bodies_[k].p, &pdot = bodies_[k].pdot;
    const Vector4d a = a_.segment<4>(row + 3);
    const Lanes<4> p_dir = y_dir.middleRows<4>(row + 3), pdot_dir = y_dir.middleRows<4>(7 * n + row + 3);
    const double pp = p.squaredNorm(), vv = pdot.squaredNorm();
    const Lanes<1> p_p_dir = dot(p, p_dir);
    const Vector3d e = a.tail<3>();
    z_dir_[k - 1].setZero();
    z_dir_[k - 1].bottomRows<3>() = (-2 / pp) * (a(0) * p_dir.bottomRows<3>() - e * p_dir.row(0) -
                                                 cross(e, p_dir.bottomRows<3>()) + z_[k - 1].tail<3>() * p_p_dir);
    r_dir.middleRows<6>(row) = rhs_lanes_[k - 1] - solver_.mass_times(i, z_dir_[k - 1]);
    r_dir.row(row + 6) = -dot(a, p_dir) - (2 * pp) * dot(pdot, pdot_dir) - (2 * vv) * p_p_dir;
  }
  solver_.rows().subtract_times(z_dir_, gamma_dir_);
  r_dir.bottomRows(data_.m) = gamma_dir_;
}

void Dynamics::add_residual_adjoint(const Eigen::VectorXd& r_bar, Eigen::Ref<Eigen::VectorXd> y_bar,
                                    Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  const int n = data_.n;
  mu_ = r_bar.tail(data_.m);
  for (int i = 1; i <= n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    eta_[k - 1] = r_bar.segment<6>(7 * (i - 1));
    pddot_bar_[k].setZero();
    loads_[k - 1] = -solver_.mass_times(i, eta_[k - 1]);
  }
  solver_.rows().subtract_transposed_times(mu_, loads_);  // z_bar = -(M eta + J'mu)
  for (int i = 1; i <= n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    const Eigen::Index q = 7 * (i - 1), v = 7 * n + q;
    const Vector4d &p = bodies_[k].p, &pdot = bodies_[k].pdot;
    const Vector4d a = a_.segment<4>(q + 3);
    const Vector3d w_bar = loads_[k - 1].tail<3>();
    const double r_p = r_bar(q + 6), pp = p.squaredNorm();
    y_bar.segment<4>(q + 3) -= (2 / pp) * (G_transposed_times(a, w_bar) + z_[k - 1].tail<3>().dot(w_bar) * p);
    y_bar.segment<4>(q + 3) -= r_p * (a + (2 * pdot.squaredNorm()) * p);
    y_bar.segment<4>(v + 3) -= (2 * r_p * pp) * pdot;
  }
  pull_back(y_bar, theta_bar, rho_bar);
}

Mat<7, 7> Dynamics::mass_block(int body) const {
  const BodyData& b = data_.bodies[static_cast<std::size_t>(body)];
  const Vector4d& p = bodies_[static_cast<std::size_t>(body)].p;
  Mat<7, 7> X = Mat<7, 7>::Zero();
  X.diagonal().head<3>().setConstant(b.mass);
  X.block<3, 4>(3, 3) = (2 / p.squaredNorm()) * (b.J * G(p));
  X.block<1, 4>(6, 3) = p.transpose();
  return X;
}

Mat<3, 4> Dynamics::omegadot_by_p(int body) const {
  const std::size_t k = static_cast<std::size_t>(body);
  const Vector4d& p = bodies_[k].p;
  return (-2 / p.squaredNorm()) * (G(a_.segment<4>(7 * (body - 1) + 3)) + z_[k - 1].tail<3>() * p.transpose());
}

void Dynamics::add_fixed_a(int body, Mat<7, 7>& q, Mat<7, 7>& v) const {
  const std::size_t k = static_cast<std::size_t>(body);
  const Vector4d &p = bodies_[k].p, &pdot = bodies_[k].pdot;
  q.block<3, 4>(3, 3) += data_.bodies[k].J * omegadot_by_p(body);
  q.block<1, 4>(6, 3) = (a_.segment<4>(7 * (body - 1) + 3) + 2 * pdot.squaredNorm() * p).transpose();
  v.block<1, 4>(6, 3) = 2 * p.squaredNorm() * pdot.transpose();
}

Mat<1, 7> Dynamics::times_T(int body, const Mat<1, 6>& J_row) const {
  const Vector4d& p = bodies_[static_cast<std::size_t>(body)].p;
  Mat<1, 7> x;
  x.head<3>() = J_row.head<3>();
  x.tail<4>() = (2 / p.squaredNorm()) * G_transposed_times(p, J_row.tail<3>().transpose()).transpose();
  return x;
}

}  // namespace mbsopt
