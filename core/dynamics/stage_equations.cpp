#include "core/dynamics/stage_equations.hpp"

#include "core/body/euler_parameters.hpp"
#include "core/body/state_layout.hpp"

namespace mbsopt {
namespace {

Lanes<1> dot(const Vector4d& a, const Lanes<4>& b) {
  return a(0) * b.row(0) + a(1) * b.row(1) + a(2) * b.row(2) + a(3) * b.row(3);
}

}  // namespace

StageEquations::StageEquations(SpatialDynamics& dynamics)
    : dynamics_(dynamics), terms_(dynamics.terms()), data_(dynamics.data()) {
  const std::size_t n = static_cast<std::size_t>(data_.n);
  a_.setZero(StateLayout{data_.n}.positions());
  mu_.setZero(data_.m);
  z_bar_.resize(n);
  eta_.resize(n);
  z_dir_.resize(n);
  no_pddot_bar_.assign(n + 1, Vector4d::Zero());
}

void StageEquations::place_at(double t, const Eigen::VectorXd& y, const Eigen::VectorXd& angles,
                              const Eigen::Ref<const Eigen::VectorXd>& a,
                              const Eigen::Ref<const Eigen::VectorXd>& lambda) {
  ++places_;
  a_ = a;
  terms_.set_motion(t, y, angles, a, lambda);
  dynamics_.solver().place(terms_.frames);
}

void StageEquations::residual(Eigen::Ref<Eigen::VectorXd> r) {
  const StateLayout layout{data_.n};
  terms_.set_loads();
  std::vector<Vec<6>>& b = terms_.f;
  for (int i = 1; i <= data_.n; ++i) b[at(i - 1)] -= dynamics_.solver().mass_times(i, terms_.z[at(i - 1)]);
  rows().subtract_transposed_times(terms_.lambda, b);
  terms_.acceleration_errors(mu_);
  for (std::size_t k = 1; k < terms_.frames.size(); ++k) {
    const Vector4d &p = terms_.frames[k].p, &pdot = terms_.frames[k].pdot;
    r.segment<6>(layout.q(k)) = b[k - 1];
    r(layout.q(k) + 6) = -p.dot(a_.segment<4>(layout.p(k))) - pdot.squaredNorm() * p.squaredNorm();
  }
  r.tail(data_.m) = compliance() * terms_.lambda - mu_;
}

void StageEquations::tangent(const ParameterBlock& block, const LaneRows& y_dir, LaneRows& r_dir) {
  const StateLayout layout{data_.n};
  terms_.set_tangents(block, y_dir);
  for (int i = 1; i <= data_.n; ++i) {
    const std::size_t k = at(i);
    const Vector4d &p = terms_.frames[k].p, &pdot = terms_.frames[k].pdot;
    const Vector4d a = a_.segment<4>(layout.p(i));
    const Lanes<4> p_dir = y_dir.middleRows<4>(layout.p(i)), pdot_dir = y_dir.middleRows<4>(layout.pdot(i));
    const double pp = p.squaredNorm(), vv = pdot.squaredNorm();
    const Lanes<1> p_p_dir = dot(p, p_dir);
    z_dir_[k - 1].setZero();
    z_dir_[k - 1].bottomRows<3>() = omegadot_by_p(i) * p_dir;
    r_dir.middleRows<6>(layout.q(i)) = terms_.b_dir[k - 1] - dynamics_.solver().mass_times(i, z_dir_[k - 1]);
    r_dir.row(layout.q(i) + 6) = -dot(a, p_dir) - (2 * pp) * dot(pdot, pdot_dir) - (2 * vv) * p_p_dir;
  }
  rows().subtract_times(z_dir_, terms_.c_dir);
  r_dir.bottomRows(data_.m) = terms_.c_dir;
}

void StageEquations::add_adjoint(const Eigen::VectorXd& r_bar, Eigen::Ref<Eigen::VectorXd> y_bar,
                                 Eigen::VectorXd& theta_bar, Eigen::VectorXd& rho_bar) {
  const StateLayout layout{data_.n};
  mu_ = r_bar.tail(data_.m);
  for (int i = 1; i <= data_.n; ++i) {
    eta_[at(i - 1)] = r_bar.segment<6>(layout.q(i));
    z_bar_[at(i - 1)] = -dynamics_.solver().mass_times(i, eta_[at(i - 1)]);
  }
  rows().subtract_transposed_times(mu_, z_bar_);  // z_bar = -(M eta + J'mu)
  for (std::size_t k = 1; k < terms_.frames.size(); ++k) {
    const Vector4d &p = terms_.frames[k].p, &pdot = terms_.frames[k].pdot;
    const Vector4d a = a_.segment<4>(layout.p(k));
    const Vector3d w_bar = z_bar_[k - 1].tail<3>();
    const double r_p = r_bar(layout.q(k) + 6), pp = p.squaredNorm();
    auto p_bar = y_bar.segment<4>(layout.p(k));
    p_bar += omegadot_by_p(static_cast<int>(k)).transpose() * w_bar;
    p_bar -= r_p * (a + (2 * pdot.squaredNorm()) * p);
    y_bar.segment<4>(layout.pdot(k)) -= (2 * r_p * pp) * pdot;
  }
  terms_.add_pull_back(eta_, mu_, no_pddot_bar_, y_bar, theta_bar, rho_bar);
}

// M of a body, column by column.
Mat<6, 6> StageEquations::mass(int body) const {
  Mat<6, 6> M;
  for (int k = 0; k < 6; ++k) M.col(k) = dynamics_.solver().mass_times(body, Vec<6>(Vec<6>::Unit(k)));
  return M;
}

Mat<7, 7> StageEquations::mass_block(int body) const {
  const Vector4d& p = terms_.frames[at(body)].p;
  const Mat<6, 6> M = mass(body);
  Mat<7, 7> X = Mat<7, 7>::Zero();
  X.topLeftCorner<6, 3>() = M.leftCols<3>();
  X.block<6, 4>(0, 3) = (2 / p.squaredNorm()) * (M.rightCols<3>() * G(p));
  X.block<1, 4>(6, 3) = p.transpose();
  return X;
}

Mat<3, 4> StageEquations::omegadot_by_p(int body) const {
  const Vector4d& p = terms_.frames[at(body)].p;
  const Vector4d a = a_.segment<4>(StateLayout{data_.n}.p(body));
  return (-2 / p.squaredNorm()) * (G(a) + terms_.z[at(body - 1)].tail<3>() * p.transpose());
}

void StageEquations::add_fixed_a(int body, Mat<7, 7>& q, Mat<7, 7>& v) const {
  const Vector4d &p = terms_.frames[at(body)].p, &pdot = terms_.frames[at(body)].pdot;
  const Vector4d a = a_.segment<4>(StateLayout{data_.n}.p(body));
  q.block<6, 4>(0, 3) += mass(body).rightCols<3>() * omegadot_by_p(body);
  q.block<1, 4>(6, 3) = (a + 2 * pdot.squaredNorm() * p).transpose();
  v.block<1, 4>(6, 3) = 2 * p.squaredNorm() * pdot.transpose();
}

Mat<1, 7> StageEquations::times_Z(int body, const Mat<1, 6>& J_row) const {
  const Vector4d& p = terms_.frames[at(body)].p;
  Mat<1, 7> x;
  x.head<3>() = J_row.head<3>();
  x.tail<4>() = (2 / p.squaredNorm()) * G_transposed_times(p, J_row.tail<3>().transpose()).transpose();
  return x;
}

}  // namespace mbsopt
